// SPDX-License-Identifier: Apache-2.0
#include <glog/logging.h>
#include <mujoco/mujoco.h>

#include <cmath>
#include <cstring>
#include <iomanip>
#include <sstream>
#include <string>

#include "tangible/estimation/experiments/cartpole/cart_pole.h"

namespace tangible {
namespace {

constexpr double kMujocoStep = 0.002;  // s

// In MuJoCo's x-z plane; an angle about −y is counter-clockwise there.
std::string Describe(const CartPole& numbers) {
  std::ostringstream xml;
  xml << std::setprecision(17) << "<mujoco><option timestep='" << kMujocoStep
      << "' gravity='0 0 -9.81'/><worldbody><body name='cart'>"
      << "<inertial pos='0 0 0' mass='" << numbers.cart_mass << "' diaginertia='1 1 1'/>"
      << "<joint type='slide' axis='1 0 0' damping='" << numbers.cart_damping << "'/>"
      << "<body name='pole'><joint type='hinge' axis='0 -1 0' damping='" << numbers.pole_damping
      << "'/><inertial pos='0 0 " << 0.5 * numbers.length << "' mass='" << numbers.pole_mass
      << "' diaginertia='" << numbers.PoleInertia() << ' ' << numbers.PoleInertia() << ' '
      << numbers.PoleInertia() << "'/></body></body></worldbody></mujoco>";
  return xml.str();
}

class MujocoPlant : public CartPolePlant {
 public:
  explicit MujocoPlant(const CartPole& numbers) {
    const std::string xml = Describe(numbers);
    auto files = std::make_unique<mjVFS>();
    mj_defaultVFS(files.get());
    mj_makeEmptyFileVFS(files.get(), "cart_pole.xml", static_cast<int>(xml.size()));
    std::memcpy(files->filedata[0], xml.data(), xml.size());
    char error[1000] = "";
    model_ = mj_loadXML("cart_pole.xml", files.get(), error, sizeof(error));
    mj_deleteVFS(files.get());
    CHECK(model_ != nullptr) << "MuJoCo: " << error;
    data_ = mj_makeData(model_);
  }
  ~MujocoPlant() override {
    mj_deleteData(data_);
    mj_deleteModel(model_);
  }
  MujocoPlant(const MujocoPlant&) = delete;
  MujocoPlant& operator=(const MujocoPlant&) = delete;

  CartPoleState Advance(const CartPoleState& state, double force, double seconds) override {
    mj_resetData(model_, data_);
    for (int i = 0; i < 2; ++i) {
      data_->qpos[i] = state[i];
      data_->qvel[i] = state[2 + i];
    }
    for (long k = std::lround(seconds / kMujocoStep); k > 0; --k) {
      data_->qfrc_applied[0] = force;
      mj_step(model_, data_);
    }
    return {data_->qpos[0], data_->qpos[1], data_->qvel[0], data_->qvel[1]};
  }

 private:
  mjModel* model_ = nullptr;
  mjData* data_ = nullptr;
};

}  // namespace

std::unique_ptr<CartPolePlant> MakeMujocoPlant(const CartPole& numbers) {
  return std::make_unique<MujocoPlant>(numbers);
}

}  // namespace tangible
