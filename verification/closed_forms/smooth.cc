// SPDX-License-Identifier: Apache-2.0
//
// Accelerations that vary: pendulums, and a box that tips about its corner.

#include <cmath>

#include "tangible/verification/closed_forms/closed_form.h"
#include "tangible/verification/support/extrapolation.h"

namespace tangible::closed_forms {
namespace {

constexpr char kPendulum[] = R"({"bodies": [
  {"name": "rod", "mass": 1, "inertia": 1, "position": [0, -1]}],
  "joints": [{"name": "pin", "type": "revolute", "bodies": ["rod", "world"], "anchor": [0, 0],
              "angle": 0.1}],
  "simulation": {"joint_correction": "projection"}})";

constexpr char kDoublePendulum[] = R"({"bodies": [
  {"name": "upper", "mass": 1, "inertia": 1, "position": [0, -1]},
  {"name": "lower", "mass": 1, "inertia": 1, "position": [0, -2]}],
  "joints": [
    {"name": "pin", "type": "revolute", "bodies": ["upper", "world"], "anchor": [0, 0],
     "angle": 0.1, "rate": 0.1},
    {"name": "elbow", "type": "revolute", "bodies": ["lower", "upper"], "anchor": [0, -1],
     "angle": 0.1, "rate": 0.1}],
  "simulation": {"joint_correction": "projection"}})";

constexpr char kTippingBox[] = R"({"bodies": [
  {"name": "box", "shape": {"box": {"size": [1, 1]}}, "mass": 1, "position": [0, 0.5]},
  {"name": "plane", "static": true, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
  "forces": [{"name": "push", "body": "box", "force": [1, 0], "at": [-0.5, 0.5]}],
  "pairs": [{"bodies": ["box", "plane"], "friction": 0.5}]})";

// Point masses: bodies have an inertia > 0, so that they hang by their centres on massless rods,
// and their own angles do not matter.
constexpr char kPointPendulum[] = R"({"bodies": [
  {"name": "mass", "mass": 1, "inertia": 1, "position": [0, -1]}],
  "joints": [{"name": "rod", "type": "distance", "bodies": ["mass", "world"],
              "anchors": [[0, -1], [0, 0]]}],
  "simulation": {"joint_correction": "projection"}})";

constexpr char kPointDoublePendulum[] = R"({"bodies": [
  {"name": "upper", "mass": 1, "inertia": 1, "position": [0, -1]},
  {"name": "lower", "mass": 1, "inertia": 1, "position": [0, -2]}],
  "joints": [
    {"name": "rod", "type": "distance", "bodies": ["upper", "world"],
     "anchors": [[0, -1], [0, 0]]},
    {"name": "second_rod", "type": "distance", "bodies": ["lower", "upper"],
     "anchors": [[0, -2], [0, -1]]}],
  "simulation": {"joint_correction": "projection"}})";

using SceneNumbers = std::vector<std::pair<std::string, Number>>;

void AddPoint(const std::string& path, const Number& x, const Number& y, SceneNumbers* numbers) {
  numbers->emplace_back(path + "/x", x);
  numbers->emplace_back(path + "/y", y);
}

// Angle from the downward vertical, and its rate, of (x, y) with velocity (u, v).
Number HangingAngle(const Number& x, const Number& y) { return atan2(x, -y); }
Number HangingRate(const Number& x, const Number& y, const Number& u, const Number& v) {
  return (x * v - y * u) / (x * x + y * y);
}

struct Jacobi {
  Number sn, cn, dn;
};

// Jacobi's elliptic functions of argument u and modulus 0 < k < 1, by the arithmetic-geometric mean
// (Abramowitz, Stegun, 16.4): converges quadratically.
Jacobi EllipticFunctions(const Number& u, const Number& k) {
  constexpr int kMost = 12;
  Number a(1.0), b = sqrt(1.0 - k * k);
  Number ratio[kMost];  // c_n / a_n
  double scale = 1.0;
  int n = 0;
  for (; n < kMost && std::abs((a - b).a) > 1e-17; ++n) {
    const Number c = 0.5 * (a - b);
    const Number mean = 0.5 * (a + b);
    b = sqrt(a * b);
    a = mean;
    ratio[n] = c / a;
    scale *= 2.0;
    if (std::abs(ratio[n].a) < 1e-16) {
      ++n;
      break;
    }
  }
  Number phi = scale * a * u;
  for (int i = n - 1; i >= 0; --i) phi = 0.5 * (phi + asin(ratio[i] * sin(phi)));
  const Number sn = sin(phi), cn = cos(phi);
  return {sn, cn, sqrt(1.0 - k * k * sn * sn)};
}

// theta = 2 asin(k cd(w t)), k = sin(theta0 / 2), w² = m g L / (Ic + m L²).
std::vector<Number> ExactPendulum(const NumberMap& p) {
  const Number moment = p.at("m") * p.at("L");
  const Number frequency = sqrt(moment * p.at("g") / (p.at("Ic") + moment * p.at("L")));
  const Number k = sin(0.5 * p.at("theta0"));
  const Jacobi f = EllipticFunctions(frequency * p.at("T"), k);
  return {2.0 * asin(k * f.cn / f.dn), -2.0 * k * frequency * sqrt(1.0 - k * k) * f.sn / f.dn};
}

// y = (th1, th2, w1, w2):
//   M11 a1 + M12 a2 + m2 l1 c2 sin(th1 − th2) w2² + (m1 c1 + m2 l1) g sin th1 = 0
//   M12 a1 + M22 a2 − m2 l1 c2 sin(th1 − th2) w1² + m2 c2 g sin th2 = 0
std::vector<Number> DoublePendulumRates(const NumberMap& p, const std::vector<Number>& y) {
  const Number &m1 = p.at("m1"), &m2 = p.at("m2"), &l1 = p.at("l1"), &c1 = p.at("c1");
  const Number &c2 = p.at("c2"), &g = p.at("g");
  const Number coupling = m2 * l1 * c2;
  const Number M11 = p.at("I1") + m1 * c1 * c1 + m2 * l1 * l1;
  const Number M12 = coupling * cos(y[0] - y[1]);
  const Number M22 = p.at("I2") + m2 * c2 * c2;
  const Number turn = coupling * sin(y[0] - y[1]);
  const Number f1 = -turn * y[3] * y[3] - (m1 * c1 + m2 * l1) * g * sin(y[0]);
  const Number f2 = turn * y[2] * y[2] - m2 * c2 * g * sin(y[1]);
  const Number determinant = M11 * M22 - M12 * M12;
  return {y[2], y[3], (M22 * f1 - M12 * f2) / determinant, (M11 * f2 - M12 * f1) / determinant};
}

std::vector<Number> ExactDoublePendulum(const NumberMap& p) {
  const std::function<std::vector<Number>(const std::vector<Number>&)> rates =
      [&p](const std::vector<Number>& y) { return DoublePendulumRates(p, y); };
  const std::vector<Number> start = {p.at("th1_0"), p.at("th2_0"), p.at("w1_0"), p.at("w2_0")};
  const int steps = 4 + static_cast<int>(20.0 * p.at("T").a);
  std::vector<Number> y = Extrapolate(rates, start, p.at("T"), steps);
  const Number &l1 = p.at("l1"), &c1 = p.at("c1"), &c2 = p.at("c2");
  y.push_back(c1 * sin(y[0]));
  y.push_back(-c1 * cos(y[0]));
  y.push_back(l1 * sin(y[0]) + c2 * sin(y[1]));
  y.push_back(-l1 * cos(y[0]) - c2 * cos(y[1]));
  return y;
}

// (m (w² + h²) / 3) phi'' = F (w sin phi + h cos phi) + m g (h/2 sin phi − w/2 cos phi)
std::vector<Number> ExactBoxTip(const NumberMap& p) {
  const Number &w = p.at("w"), &h = p.at("h"), &m = p.at("m"), &F = p.at("F");
  const Number weight = m * p.at("g");
  const Number inertia = m * (w * w + h * h) / 3.0;
  const std::function<std::vector<Number>(const std::vector<Number>&)> rates =
      [&](const std::vector<Number>& y) {
        const Number s = sin(y[0]), c = cos(y[0]);
        return std::vector<Number>{
            y[1], (F * (w * s + h * c) + 0.5 * weight * (h * s - w * c)) / inertia};
      };
  std::vector<Number> y = Extrapolate(rates, {Number(0.0), Number(0.0)}, p.at("T"), 8);
  const Number s = sin(y[0]), c = cos(y[0]);
  y.push_back(0.5 * (h * s - w * c));
  y.push_back(0.5 * (h * c + w * s));
  return y;
}

// The same with Ic = 0.
void HangPointMass(ClosedForm* form) {
  form->scene_json = kPointPendulum;
  form->numbers = [](const NumberMap& p) {
    SceneNumbers numbers = {{"bodies/mass/mass", p.at("m")}, {"gravity/y", -p.at("g")}};
    const Number x = p.at("L") * sin(p.at("theta0")), y = -p.at("L") * cos(p.at("theta0"));
    AddPoint("bodies/mass/position", x, y, &numbers);
    AddPoint("joints/rod/anchors/0", x, y, &numbers);
    return numbers;
  };
  form->read = [](const NumberMap& p, const FinalState& s) {
    std::vector<Number> outputs = {HangingAngle(s[0], s[1]), HangingRate(s[0], s[1], s[3], s[4])};
    DropDerivative(p.at("Ic"), &outputs);
    return outputs;
  };
}

// c1 = l1, c2 = l2, I1 = I2 = 0.
ClosedForm PointDoublePendulum(const std::string& name, const Inputs& inputs) {
  ClosedForm form{
      name,
      Kind::kSmooth,
      Take(inputs, {"m1", "m2", "l1", "l2", "g", "th1_0", "th2_0", "w1_0", "w2_0", "T"}),
      {"th1_T", "th2_T", "w1_T", "w2_T", "x1_T", "y1_T", "x2_T", "y2_T"},
      {},
      kPointDoublePendulum,
      {},
      {}};
  form.exact = [](const NumberMap& p) {
    NumberMap all = p;
    all["c1"] = p.at("l1");
    all["c2"] = p.at("l2");
    all["I1"] = all["I2"] = Number(0.0);
    return ExactDoublePendulum(all);
  };
  form.numbers = [](const NumberMap& p) {
    const Number s1 = sin(p.at("th1_0")), c1 = cos(p.at("th1_0"));
    const Number s2 = sin(p.at("th2_0")), c2 = cos(p.at("th2_0"));
    const Number x1 = p.at("l1") * s1, y1 = -p.at("l1") * c1;
    const Number x2 = x1 + p.at("l2") * s2, y2 = y1 - p.at("l2") * c2;
    const Number v1 = p.at("l1") * p.at("w1_0"), v2 = p.at("l2") * p.at("w2_0");
    SceneNumbers numbers = {{"bodies/upper/mass", p.at("m1")},
                            {"bodies/lower/mass", p.at("m2")},
                            {"gravity/y", -p.at("g")}};
    AddPoint("bodies/upper/position", x1, y1, &numbers);
    AddPoint("bodies/lower/position", x2, y2, &numbers);
    AddPoint("joints/rod/anchors/0", x1, y1, &numbers);
    AddPoint("joints/second_rod/anchors/0", x2, y2, &numbers);
    AddPoint("joints/second_rod/anchors/1", x1, y1, &numbers);
    AddPoint("bodies/upper/velocity", v1 * c1, v1 * s1, &numbers);
    AddPoint("bodies/lower/velocity", v1 * c1 + v2 * c2, v1 * s1 + v2 * s2, &numbers);
    return numbers;
  };
  form.read = [](const NumberMap&, const FinalState& s) {
    const Number dx = s[6] - s[0], dy = s[7] - s[1];
    return std::vector<Number>{HangingAngle(s[0], s[1]),
                               HangingAngle(dx, dy),
                               HangingRate(s[0], s[1], s[3], s[4]),
                               HangingRate(dx, dy, s[9] - s[3], s[10] - s[4]),
                               s[0],
                               s[1],
                               s[6],
                               s[7]};
  };
  return form;
}

}  // namespace

ClosedForm PhysicalPendulum(const std::string& name, const Inputs& inputs) {
  ClosedForm form{name,
                  Kind::kSmooth,
                  Take(inputs, {"m", "L", "Ic", "g", "theta0", "T"}),
                  {"theta_T", "omega_T"},
                  &ExactPendulum,
                  kPendulum,
                  {},
                  {}};
  form.numbers = [](const NumberMap& p) {
    return std::vector<std::pair<std::string, Number>>{{"bodies/rod/mass", p.at("m")},
                                                       {"bodies/rod/inertia", p.at("Ic")},
                                                       {"bodies/rod/position/y", -p.at("L")},
                                                       {"joints/pin/angle", p.at("theta0")},
                                                       {"gravity/y", -p.at("g")}};
  };
  form.read = [](const NumberMap&, const FinalState& s) { return std::vector<Number>{s[2], s[5]}; };
  if (inputs.at("Ic") == 0.0) HangPointMass(&form);
  return form;
}

ClosedForm DoublePendulum(const std::string& name, const Inputs& inputs) {
  if (inputs.at("I1") == 0.0 && inputs.at("I2") == 0.0) return PointDoublePendulum(name, inputs);
  ClosedForm form{name,
                  Kind::kSmooth,
                  Take(inputs, {"m1", "m2", "l1", "l2", "c1", "c2", "I1", "I2", "g", "th1_0",
                                "th2_0", "w1_0", "w2_0", "T"}),
                  {"th1_T", "th2_T", "w1_T", "w2_T", "x1_T", "y1_T", "x2_T", "y2_T"},
                  &ExactDoublePendulum,
                  kDoublePendulum,
                  {},
                  {}};
  form.numbers = [](const NumberMap& p) {
    return std::vector<std::pair<std::string, Number>>{
        {"bodies/upper/mass", p.at("m1")},
        {"bodies/lower/mass", p.at("m2")},
        {"bodies/upper/inertia", p.at("I1")},
        {"bodies/lower/inertia", p.at("I2")},
        {"bodies/upper/position/y", -p.at("c1")},
        {"bodies/lower/position/y", -p.at("l1") - p.at("c2")},
        {"joints/elbow/anchor/y", -p.at("l1")},
        {"joints/pin/angle", p.at("th1_0")},
        {"joints/elbow/angle", p.at("th2_0") - p.at("th1_0")},
        {"joints/pin/rate", p.at("w1_0")},
        {"joints/elbow/rate", p.at("w2_0") - p.at("w1_0")},
        {"gravity/y", -p.at("g")}};
  };
  form.read = [](const NumberMap&, const FinalState& s) {
    return std::vector<Number>{s[2], s[8], s[5], s[11], s[0], s[1], s[6], s[7]};
  };
  return form;
}

ClosedForm BoxTip(const std::string& name, const Inputs& inputs) {
  ClosedForm form{name,
                  Kind::kSmooth,
                  Take(inputs, {"w", "h", "m", "mu", "g", "F", "T"}),
                  {"phi_T", "omega_T", "xcom_rel_pivot_T", "ycom_rel_pivot_T"},
                  &ExactBoxTip,
                  kTippingBox,
                  {},
                  {}};
  form.numbers = [](const NumberMap& p) {
    return std::vector<std::pair<std::string, Number>>{{"bodies/box/shape/size/x", p.at("w")},
                                                       {"bodies/box/shape/size/y", p.at("h")},
                                                       {"bodies/box/position/y", 0.5 * p.at("h")},
                                                       {"bodies/box/mass", p.at("m")},
                                                       {"pairs/box:plane/friction", p.at("mu")},
                                                       {"forces/push/force/x", p.at("F")},
                                                       {"forces/push/at/x", -0.5 * p.at("w")},
                                                       {"forces/push/at/y", 0.5 * p.at("h")},
                                                       {"gravity/y", -p.at("g")}};
  };
  form.read = [](const NumberMap& p, const FinalState& s) {
    return std::vector<Number>{-s[2], -s[5], s[0] - 0.5 * p.at("w"), s[1]};
  };
  return form;
}

}  // namespace tangible::closed_forms
