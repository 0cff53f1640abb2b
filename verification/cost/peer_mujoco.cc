// SPDX-License-Identifier: Apache-2.0
#include <mujoco/mujoco.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <iomanip>
#include <sstream>
#include <string>
#include <vector>

#include "tangible/verification/cost/peers.h"

namespace tangible {
namespace {

// The scene in MuJoCo's language, in its x-z plane.
class Writer {
 public:
  explicit Writer(const Scene& scene) : scene_(scene) { xml_ << std::setprecision(17); }

  std::string Write() {
    xml_ << "<mujoco><option timestep='" << scene_.simulation.dt << "' gravity='"
         << scene_.gravity.x() << " 0 " << scene_.gravity.y()
         << "' solver='Newton' tolerance='1e-8' iterations='100' cone='pyramidal'/>"
         << "<size njmax='" << 24 * scene_.bodies.size() + 100 << "' nconmax='"
         << 6 * scene_.bodies.size() + 25 << "'/><worldbody>";
    for (size_t i = 0; i < scene_.bodies.size(); ++i) {
      if (scene_.bodies[i].motion != Motion::kMoving) {
        Geom(scene_.bodies[i], scene_.bodies[i].position);
      } else if (ParentOf(static_cast<int>(i)) < 0) {
        Body(static_cast<int>(i), Vector2<double>(0.0, 0.0));
      }
    }
    xml_ << "</worldbody></mujoco>";
    return xml_.str();
  }

 private:
  const BasicJoint<double>* JointOf(int body) const {
    for (const BasicJoint<double>& joint : scene_.joints) {
      if (joint.bodies[0] == body) {
        return &joint;
      }
    }
    return nullptr;
  }
  int ParentOf(int body) const {
    const BasicJoint<double>* joint = JointOf(body);
    return joint == nullptr ? -1 : joint->bodies[1];
  }

  void Geom(const BasicBody<double>& body, const Vector2<double>& at) {
    const std::vector<double>& n = body.shape.numbers;
    switch (body.shape.type) {
      case ShapeType::kCircle:
        xml_ << "<geom type='sphere' size='" << n[0] << "'";
        break;
      case ShapeType::kBox:
        xml_ << "<geom type='box' size='" << 0.5 * n[0] << " 0.5 " << 0.5 * n[1] << "'";
        break;
      case ShapeType::kHalfPlane:
        xml_ << "<geom type='plane' size='0 0 1' zaxis='" << n[0] << " 0 " << n[1] << "'";
        break;
      default:
        std::abort();  // no benchmark has it
    }
    // Bodies named in no_contact do not collide.
    bool apart = false;
    for (const auto& [x, y] : scene_.no_contact) {
      apart = apart || MatchesPattern(x, body.name) || MatchesPattern(y, body.name);
    }
    const bool plane = body.shape.type == ShapeType::kHalfPlane;
    const double x = plane ? n[0] * n[2] : at.x();
    const double z = plane ? n[1] * n[2] : at.y();
    xml_ << " pos='" << x << " 0 " << z << "' condim='3' friction='" << body.friction
         << " 0 0' contype='" << (apart ? 1 : 3) << "' conaffinity='" << (apart ? 2 : 3) << "'/>";
  }

  double InertiaOf(const BasicBody<double>& body) const {
    const std::vector<double>& n = body.shape.numbers;
    return body.shape.type == ShapeType::kCircle ? 0.5 * body.mass * n[0] * n[0]
                                                 : body.mass * (n[0] * n[0] + n[1] * n[1]) / 12.0;
  }

  void Body(int index, const Vector2<double>& parent) {
    const BasicBody<double>& body = scene_.bodies[index];
    xml_ << "<body name='" << body.name << "' pos='" << body.position.x() - parent.x() << " 0 "
         << body.position.y() - parent.y() << "'>";
    if (const BasicJoint<double>* joint = JointOf(index)) {
      xml_ << "<joint type='hinge' axis='0 -1 0' pos='" << joint->anchors[0].x() - body.position.x()
           << " 0 " << joint->anchors[0].y() - body.position.y() << "'/>";
    } else {
      xml_ << "<joint name='" << body.name << "_x' type='slide' axis='1 0 0'/>"
           << "<joint name='" << body.name << "_z' type='slide' axis='0 0 1'/>"
           << "<joint type='hinge' axis='0 -1 0'/>";
    }
    xml_ << "<inertial pos='0 0 0' mass='" << body.mass << "' diaginertia='" << InertiaOf(body)
         << ' ' << InertiaOf(body) << ' ' << InertiaOf(body) << "'/>";
    Geom(body, Vector2<double>(0.0, 0.0));
    for (size_t i = 0; i < scene_.bodies.size(); ++i) {
      if (scene_.bodies[i].motion == Motion::kMoving && ParentOf(static_cast<int>(i)) == index) {
        Body(static_cast<int>(i), body.position);
      }
    }
    xml_ << "</body>";
  }

  const Scene& scene_;
  std::ostringstream xml_;
};

class Mujoco : public Peer {
 public:
  explicit Mujoco(const Scene& scene) {
    const std::string xml = Writer(scene).Write();
    auto vfs = std::make_unique<mjVFS>();
    mj_defaultVFS(vfs.get());
    mj_makeEmptyFileVFS(vfs.get(), "scene.xml", static_cast<int>(xml.size()));
    std::memcpy(vfs->filedata[0], xml.data(), xml.size());
    char error[1000] = "";
    model_ = mj_loadXML("scene.xml", vfs.get(), error, sizeof(error));
    mj_deleteVFS(vfs.get());
    if (model_ == nullptr) {
      std::fprintf(stderr, "MuJoCo: %s\n", error);
      std::abort();
    }
    data_ = mj_makeData(model_);
    for (const BasicBody<double>& body : scene.bodies) {
      id_.push_back(
          body.motion == Motion::kMoving ? mj_name2id(model_, mjOBJ_BODY, body.name.c_str()) : -1);
      for (int k = 0; k < 2 && id_.back() >= 0; ++k) {
        const int joint =
            mj_name2id(model_, mjOBJ_JOINT, (body.name + (k == 0 ? "_x" : "_z")).c_str());
        if (joint >= 0) {
          data_->qvel[model_->jnt_dofadr[joint]] = body.velocity[k];
        }
      }
    }
    mj_forward(model_, data_);
  }
  ~Mujoco() override {
    mj_deleteData(data_);
    mj_deleteModel(model_);
  }
  Mujoco(const Mujoco&) = delete;
  Mujoco& operator=(const Mujoco&) = delete;

  void Step() override { mj_step(model_, data_); }
  Vector2<double> PositionOf(int body) const override {
    const double* x = data_->xipos + 3 * static_cast<size_t>(id_[body]);
    return Vector2<double>(x[0], x[2]);
  }

 private:
  mjModel* model_ = nullptr;
  mjData* data_ = nullptr;
  std::vector<int> id_;
};

}  // namespace

std::unique_ptr<Peer> MujocoPeer(const Scene& scene) { return std::make_unique<Mujoco>(scene); }

}  // namespace tangible
