// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// A simulated motion as one self-contained HTML page: no network, no other file.
//
// The page draws the bodies (with a radius mark, so that rotation is visible), joints, springs, and
// the contacts with their impulses; it plays, pauses, steps and zooms, and plots kinetic, potential
// and total energy. ViewData is plain data that the code which steps a scene fills in, so that this
// module does not depend on dynamics.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "tangible/math/scalar.h"
#include "tangible/scene/scene.h"

namespace tangible {

/// The parts of a body that are drawn; its poses are in the frames.
struct ViewBody {
  std::string name;
  Motion motion = Motion::kMoving;
  BasicShape<double> shape;
  std::vector<Vector2<double>> contact_points = {};  ///< body frame, m
  std::vector<Vector2<double>> support_points = {};  ///< body frame, m
  double support_radius = 0.0;                       ///< m, of a disc; 0: none
};

/// A joint; an anchor is in the frame of its body, and in the world where the body is −1.
struct ViewJoint {
  std::string name;
  JointType type = JointType::kRevolute;
  int bodies[2] = {-1, -1};
  Vector2<double> anchors[2] = {Vector2<double>::Zero(), Vector2<double>::Zero()};
  Vector2<double> axis = Vector2<double>::UnitX();  ///< prismatic: in the frame of bodies[1]
  double rope = 0.0;  ///< m, the greatest distance of a rope's ends; 0: no bound
  bool has_motor = false;
  bool has_servo = false;
  std::optional<double> until;  ///< s, from which it is not drawn
};

/// A spring; anchors as in ViewJoint.
struct ViewSpring {
  std::string name;
  int bodies[2] = {-1, -1};
  Vector2<double> anchors[2] = {Vector2<double>::Zero(), Vector2<double>::Zero()};
};

/// A contact of one step. Impulses (N s) are those on bodies[0], along the normal n (unit, from
/// bodies[1] to bodies[0]) and along the tangent (n_y, −n_x).
struct ViewContact {
  int bodies[2] = {-1, -1};
  Vector2<double> point = Vector2<double>::Zero();  ///< m, world
  Vector2<double> normal = Vector2<double>::UnitY();
  double normal_impulse = 0.0;
  double tangential_impulse = 0.0;
  std::string mode;  ///< open, sticking, sliding_left, ...: written unchanged
};

/// A place that was observed, and where a fitted motion has it; both m, world.
struct ViewMark {
  Vector2<double> observed = Vector2<double>::Zero();
  Vector2<double> fitted = Vector2<double>::Zero();
};

/// The scene at one time.
struct ViewFrame {
  double time = 0.0;                   ///< s
  std::vector<Vector3<double>> poses;  ///< (x, y, angle) of every body, static ones included
  std::vector<ViewContact> contacts;   ///< of the step that ended here
  double kinetic_energy = 0.0;         ///< J
  double potential_energy = 0.0;       ///< J, of gravity and springs
  std::vector<ViewMark> marks = {};    ///< the latest observation of each place
};

struct ViewData {
  std::string name;                        ///< of the scene
  Vector2<double> gravity = {0.0, -9.81};  ///< m/s²
  std::vector<ViewBody> bodies;
  std::vector<ViewJoint> joints;
  std::vector<ViewSpring> springs;
  std::vector<ViewFrame> frames;  ///< times increasing
};

/// Limits of the size of the page, and the content under the animation.
struct ViewOptions {
  std::size_t max_frames = 2000;
  /// Poses and contacts written in all; fewer frames are kept where there are many bodies. About 25
  /// bytes each.
  std::size_t max_entries = 250000;
  /// HTML under the animation, such as plots; the page scrolls to it.
  std::string below{};
};

/// The frames that are kept so that the page stays within the options: every k-th one, the first
/// and the last included. A kept frame shows, instead of its own contacts, those of the frame with
/// the largest normal impulse since the kept frame before, so that no impact is lost.
std::vector<ViewFrame> ThinFrames(const ViewData& data, const ViewOptions& options);

/// The page. Numbers are written with 6 significant digits; one that is not finite becomes null,
/// and the object to which it belongs is not drawn. It does not CHECK its input: indices of bodies
/// that do not exist are drawn as the world, and a frame with the wrong number of poses is left
/// out.
std::string ViewHtml(const ViewData& data, const ViewOptions& options = {});

/// The same player as a part of another page, which has at most one. Keys act while it has the
/// focus, and the wheel zooms with Ctrl alone. Without a header; `below` is not used.
std::string ViewPart(const ViewData& data, const ViewOptions& options = {});

}  // namespace tangible
