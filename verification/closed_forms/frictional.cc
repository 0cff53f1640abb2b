// SPDX-License-Identifier: Apache-2.0
//
// Constant accelerations under Coulomb friction, between changes from slip to stick.

#include <cmath>

#include "tangible/verification/closed_forms/closed_form.h"

namespace tangible::closed_forms {
namespace {

// The blocks are low, so that they neither tip nor rock.
constexpr double kBlockHeight = 0.1;
constexpr char kBlockAndPlane[] = R"({"bodies": [
  {"name": "block", "shape": {"box": {"size": [1, 0.1]}}, "mass": 1, "position": [0, 0.05]},
  {"name": "plane", "static": true, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
  "pairs": [{"bodies": ["block", "plane"], "friction": 0.5}]})";

constexpr char kDiscOnPlane[] = R"({"bodies": [
  {"name": "disc", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "inertia": 0.005,
   "position": [0, 0.1]},
  {"name": "plane", "static": true, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
  "pairs": [{"bodies": ["disc", "plane"], "friction": 0.5}]})";

constexpr char kPushedBox[] = R"({"bodies": [
  {"name": "box", "shape": {"box": {"size": [1, 1]}}, "mass": 1, "position": [0, 0.5]},
  {"name": "plane", "static": true, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
  "forces": [{"name": "push", "body": "box", "force": [1, 0], "at": [0, 0]}],
  "pairs": [{"bodies": ["box", "plane"], "friction": 0.5}]})";

std::vector<Number> ExactBlock(const NumberMap& p) {
  const Number deceleration = p.at("mu") * p.at("g");
  const Number &v0 = p.at("v0"), &T = p.at("T");
  const Number stop = v0 / deceleration;
  if (T.a < stop.a) {
    return {p.at("x0") + v0 * T - 0.5 * deceleration * T * T, v0 - deceleration * T};
  }
  return {p.at("x0") + v0 * v0 / (2.0 * deceleration), Number(0.0)};
}

std::vector<Number> ExactIncline(const NumberMap& p) {
  const Number &v0 = p.at("v0"), &T = p.at("T");
  const Number pull = p.at("g") * sin(p.at("alpha"));
  const Number grip = p.at("mu") * p.at("g") * cos(p.at("alpha"));
  Number s = p.at("s0"), v = v0, left = T;
  if (v0.a != 0.0) {
    const Number a = v0.a > 0.0 ? pull - grip : pull + grip;
    const Number stop = -v0 / a;
    if (!(stop.a > 0.0) || T.a < stop.a) {
      return {s + v0 * T + 0.5 * a * T * T, v0 + a * T};
    }
    s += v0 * stop + 0.5 * a * stop * stop;
    v = Number(0.0);
    left = T - stop;
  }
  std::vector<Number> outputs = {s, v};
  if (pull.a > grip.a) {  // slips, down
    outputs = {s + 0.5 * (pull - grip) * left * left, (pull - grip) * left};
  }
  // An uphill start has friction of the other sign.
  if (v0.a == 0.0) DropDerivative(v0, &outputs);
  return outputs;
}

std::vector<Number> ExactSlideToRoll(const NumberMap& p) {
  const Number &v0 = p.at("v0"), &w0 = p.at("w0"), &r = p.at("r"), &T = p.at("T");
  const Number slip = v0 + w0 * r;
  const double direction = slip.a > 0.0 ? 1.0 : -1.0;
  const Number a = -direction * p.at("mu") * p.at("g");
  const Number turn = a * p.at("m") * r / p.at("I");
  const Number roll = -slip / (a + turn * r);
  const bool rolls = roll.a < T.a;
  const Number t = rolls ? roll : T;
  const Number v = v0 + a * t, w = w0 + turn * t, rest = T - t;
  return {p.at("x0") + v0 * t + 0.5 * a * t * t + v * rest,
          p.at("th0") + w0 * t + 0.5 * turn * t * t + w * rest, v, w};
}

// The disc starts from v0 = −w0 r. After a perturbation that violates this it slips for a time of
// the same order and then rolls, with the twist that has the same angular momentum about the
// contact.
std::vector<Number> ExactRolling(const NumberMap& p) {
  const Number &r = p.at("r"), &T = p.at("T");
  const Number k = p.at("I") / (p.at("m") * r * r);
  const Number a = p.at("g") * sin(p.at("alpha")) / (1.0 + k);
  const Number v = (p.at("v0") - k * r * p.at("w0")) / (1.0 + k);
  const Number gone = v * T + 0.5 * a * T * T;
  return {p.at("s0") + gone, p.at("th0") - gone / r, v + a * T, -(v + a * T) / r};
}

// Accelerations of the centre and angular, the sums of the normal and the friction force, and the
// centre of pressure from the centre: of the four motions the one whose inequalities hold.
std::vector<Number> ExactBoxPush(const NumberMap& p) {
  const Number &w = p.at("w"), &h = p.at("h"), &m = p.at("m"), &mu = p.at("mu"), &F = p.at("F");
  const Number weight = m * p.at("g");
  const Number arm = p.at("hp") - 0.5 * h;  // of the force above the centre
  const Number inertia = m * (w * w + h * h) / 12.0;
  const Number corner = 0.5 * w;
  // Upright: N = m g; the centre of pressure must lie within the base.
  const Number held = F.a > (mu * weight).a ? mu * weight : F;  // friction, against the push
  const Number pressure = (F * arm + held * 0.5 * h) / weight;
  if (std::abs(pressure.a) <= corner.a) {
    return {(F - held) / m, Number(0.0), Number(0.0), weight, -held, pressure};
  }
  // Tips about the front corner, which does not move: moments about it.
  const Number about = inertia + m * 0.25 * (w * w + h * h);
  Number alpha = -(F * p.at("hp") - weight * corner) / about;
  Number ax = -alpha * 0.5 * h;
  Number ay = -alpha * corner;
  Number normal = weight + m * ay;
  Number friction = m * ax - F;
  if (std::abs(friction.a) > (mu * normal).a) {
    // The corner slides forward, friction −μ N, and stays on the floor: ay = −alpha w/2.
    //   I alpha = −F arm + N w/2 − μ N h/2,   m ay = N − m g
    const Number lever = corner - 0.5 * mu * h;
    alpha = (weight * lever - F * arm) / (inertia + m * corner * lever);
    ay = -alpha * corner;
    normal = weight + m * ay;
    friction = -mu * normal;
    ax = (F + friction) / m;
  }
  return {ax, ay, alpha, normal, friction, corner};
}

// Duration of the step from which BoxPush takes accelerations: v = a τ, from rest a changes by τ².
constexpr double kInstant = 1e-7;

std::vector<Number> ReadBoxPush(const NumberMap& p, const FinalState& s) {
  const Number &h = p.at("h"), &w = p.at("w"), &m = p.at("m"), &F = p.at("F");
  const Number ax = s[3] / kInstant, ay = s[4] / kInstant, alpha = s[5] / kInstant;
  const Number normal = m * (p.at("g") + ay);
  const Number friction = m * ax - F;
  const Number inertia = m * (w * w + h * h) / 12.0;
  const Number arm = p.at("hp") - 0.5 * h;
  const Number pressure = (inertia * alpha + F * arm - 0.5 * h * friction) / normal;
  return {ax, ay, alpha, normal, friction, pressure};
}

// A body at the height `above` over the slope, s downhill along it.
std::vector<std::pair<std::string, Number>> OnSlope(const NumberMap& p, const std::string& body,
                                                    const Number& s, const Number& v,
                                                    const Number& above) {
  const Number c = cos(p.at("alpha")), d = sin(p.at("alpha"));
  return {{"bodies/plane/shape/normal/x", d},
          {"bodies/plane/shape/normal/y", c},
          {"bodies/" + body + "/position/x", c * s + d * above},
          {"bodies/" + body + "/position/y", c * above - d * s},
          {"bodies/" + body + "/velocity/x", c * v},
          {"bodies/" + body + "/velocity/y", -d * v},
          {"bodies/" + body + "/mass", p.at("m")},
          {"pairs/" + body + ":plane/friction", p.at("mu")},
          {"gravity/y", -p.at("g")}};
}

Number Downhill(const NumberMap& p, const Number& x, const Number& y) {
  return cos(p.at("alpha")) * x - sin(p.at("alpha")) * y;
}

}  // namespace

ClosedForm SlidingBlock(const std::string& name, const Inputs& inputs) {
  ClosedForm form{name,
                  Kind::kFrictional,
                  Take(inputs, {"x0", "v0", "mu", "g", "m", "T"}),
                  {"x_T", "v_T"},
                  &ExactBlock,
                  kBlockAndPlane,
                  {},
                  {}};
  form.numbers = [](const NumberMap& p) {
    return std::vector<std::pair<std::string, Number>>{{"bodies/block/position/x", p.at("x0")},
                                                       {"bodies/block/velocity/x", p.at("v0")},
                                                       {"bodies/block/mass", p.at("m")},
                                                       {"pairs/block:plane/friction", p.at("mu")},
                                                       {"gravity/y", -p.at("g")}};
  };
  form.read = [](const NumberMap&, const FinalState& s) { return std::vector<Number>{s[0], s[3]}; };
  return form;
}

ClosedForm Incline(const std::string& name, const Inputs& inputs) {
  ClosedForm form{name,
                  Kind::kFrictional,
                  Take(inputs, {"s0", "v0", "alpha", "mu", "g", "m", "T"}),
                  {"s_T", "v_T"},
                  &ExactIncline,
                  kBlockAndPlane,
                  {},
                  {}};
  form.numbers = [](const NumberMap& p) {
    auto numbers = OnSlope(p, "block", p.at("s0"), p.at("v0"), Number(0.5 * kBlockHeight));
    numbers.emplace_back("bodies/block/angle", -p.at("alpha"));
    return numbers;
  };
  form.read = [](const NumberMap& p, const FinalState& s) {
    return std::vector<Number>{Downhill(p, s[0], s[1]), Downhill(p, s[3], s[4])};
  };
  return form;
}

ClosedForm SlideToRoll(const std::string& name, const Inputs& inputs) {
  ClosedForm form{name,
                  Kind::kFrictional,
                  Take(inputs, {"x0", "th0", "v0", "w0", "mu", "g", "m", "r", "I", "T"}),
                  {"x_T", "th_T", "v_T", "w_T"},
                  &ExactSlideToRoll,
                  kDiscOnPlane,
                  {},
                  {}};
  form.numbers = [](const NumberMap& p) {
    return std::vector<std::pair<std::string, Number>>{
        {"bodies/disc/position/x", p.at("x0")},       {"bodies/disc/position/y", p.at("r")},
        {"bodies/disc/angle", p.at("th0")},           {"bodies/disc/velocity/x", p.at("v0")},
        {"bodies/disc/angular_velocity", p.at("w0")}, {"bodies/disc/mass", p.at("m")},
        {"bodies/disc/inertia", p.at("I")},           {"bodies/disc/shape/radius", p.at("r")},
        {"pairs/disc:plane/friction", p.at("mu")},    {"gravity/y", -p.at("g")}};
  };
  form.read = [](const NumberMap&, const FinalState& s) {
    return std::vector<Number>{s[0], s[2], s[3], s[5]};
  };
  return form;
}

ClosedForm Rolling(const std::string& name, const Inputs& inputs) {
  ClosedForm form{name,
                  Kind::kFrictional,
                  Take(inputs, {"s0", "th0", "v0", "w0", "alpha", "mu", "g", "m", "r", "I", "T"}),
                  {"s_T", "th_T", "v_T", "w_T"},
                  &ExactRolling,
                  kDiscOnPlane,
                  {},
                  {}};
  form.numbers = [](const NumberMap& p) {
    auto numbers = OnSlope(p, "disc", p.at("s0"), p.at("v0"), p.at("r"));
    numbers.emplace_back("bodies/disc/angle", p.at("th0"));
    numbers.emplace_back("bodies/disc/angular_velocity", p.at("w0"));
    numbers.emplace_back("bodies/disc/inertia", p.at("I"));
    numbers.emplace_back("bodies/disc/shape/radius", p.at("r"));
    return numbers;
  };
  form.read = [](const NumberMap& p, const FinalState& s) {
    return std::vector<Number>{Downhill(p, s[0], s[1]), s[2], Downhill(p, s[3], s[4]), s[5]};
  };
  return form;
}

ClosedForm BoxPush(const std::string& name, const Inputs& inputs) {
  ClosedForm form{name,
                  Kind::kFrictional,
                  Take(inputs, {"w", "h", "m", "mu", "g", "F", "hp"}),
                  {"ax", "ay", "alpha", "N", "Ff", "x_cop"},
                  &ExactBoxPush,
                  kPushedBox,
                  {},
                  &ReadBoxPush};
  form.instant = kInstant;
  form.numbers = [](const NumberMap& p) {
    return std::vector<std::pair<std::string, Number>>{
        {"bodies/box/shape/size/x", p.at("w")},
        {"bodies/box/shape/size/y", p.at("h")},
        {"bodies/box/position/y", 0.5 * p.at("h")},
        {"bodies/box/mass", p.at("m")},
        {"pairs/box:plane/friction", p.at("mu")},
        {"forces/push/force/x", p.at("F")},
        {"forces/push/at/y", p.at("hp") - 0.5 * p.at("h")},
        {"gravity/y", -p.at("g")}};
  };
  return form;
}

}  // namespace tangible::closed_forms
