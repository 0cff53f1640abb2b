// SPDX-License-Identifier: Apache-2.0
//
// Free flight between impacts: Newton's law of restitution v⁺ = −e v⁻ along the normal, and
// Coulomb's for the tangential impulse.

#include <cmath>

#include "tangible/verification/closed_forms/closed_form.h"

namespace tangible::closed_forms {
namespace {

constexpr char kDiscs[] = R"({"bodies": [
  {"name": "a", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 0]},
  {"name": "b", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [1, 0]}],
  "pairs": [{"bodies": ["a", "b"], "restitution": 1}]})";

constexpr char kThreeBalls[] = R"({"gravity": [0, 0], "bodies": [
  {"name": "a", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 0]},
  {"name": "b", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [1, 0]},
  {"name": "c", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [2, 0]}],
  "pairs": [{"bodies": ["a", "b"], "restitution": 1}, {"bodies": ["b", "c"], "restitution": 1}]})";

constexpr char kDiscAndPlane[] = R"({"bodies": [
  {"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "inertia": 0.005,
   "position": [0, 1]},
  {"name": "plane", "static": true, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
  "pairs": [{"bodies": ["ball", "plane"], "friction": 0, "restitution": 1}]})";

// Time to close the distance c > 0 from speed u along the normal under acceleration a:
// c + u t + a t²/2 = 0, its smaller root, written without cancellation.
Number TimeToReach(const Number& c, const Number& u, const Number& a) {
  return 2.0 * c / (-u + sqrt(u * u - 2.0 * a * c));
}

std::vector<Number> ExactDrop(const NumberMap& p) {
  const Number &g = p.at("g"), &e = p.at("e"), &r = p.at("r"), &T = p.at("T");
  const Number c = p.at("y0") - r;
  const Number t1 = TimeToReach(c, p.at("v0"), -g);
  if (T.a < t1.a) {
    return {p.at("y0") + p.at("v0") * T - 0.5 * g * T * T, p.at("v0") - g * T};
  }
  Number t = t1;
  Number u = e * sqrt(p.at("v0") * p.at("v0") + 2.0 * g * c);  // speed after the last bounce
  if (e.a == 0.0) {
    return {r, Number(0.0)};  // it rests
  }
  while (t.a + 2.0 * u.a / g.a < T.a) {
    t += 2.0 * u / g;
    u *= e;
  }
  const Number tau = T - t;
  return {r + u * tau - 0.5 * g * tau * tau, u - g * tau};
}

std::vector<Number> ExactWall(const NumberMap& p) {
  const Number nx = cos(p.at("phi")), ny = sin(p.at("phi"));
  const Number &g = p.at("g"), &T = p.at("T");
  const Number c = nx * p.at("x0") + ny * p.at("y0") - p.at("d") - p.at("r");
  const Number u = nx * p.at("vx0") + ny * p.at("vy0");
  const Number a = -g * ny;
  const Number t = TimeToReach(c, u, a);
  const Number jump = -(1.0 + p.at("e")) * (u + a * t);  // of the normal speed
  const Number rest = T - t;
  return {p.at("x0") + p.at("vx0") * T + jump * nx * rest,
          p.at("y0") + p.at("vy0") * T - 0.5 * g * T * T + jump * ny * rest,
          p.at("vx0") + jump * nx, p.at("vy0") - g * T + jump * ny};
}

std::vector<Number> ExactDiscs(const NumberMap& p) {
  const Number &m1 = p.at("m1"), &m2 = p.at("m2"), &g = p.at("g"), &T = p.at("T");
  const Number dx = p.at("x2") - p.at("x1"), dy = p.at("y2") - p.at("y1");
  const Number du = p.at("vx2") - p.at("vx1"), dv = p.at("vy2") - p.at("vy1");
  const Number reach = p.at("r1") + p.at("r2");
  const Number a = du * du + dv * dv, b = dx * du + dy * dv;
  const Number c = dx * dx + dy * dy - reach * reach;
  const Number t = c / (-b + sqrt(b * b - a * c));
  const Number nx = (dx + du * t) / reach, ny = (dy + dv * t) / reach;
  const Number j = -(1.0 + p.at("e")) * (nx * du + ny * dv) / (1.0 / m1 + 1.0 / m2);
  const Number rest = T - t;
  const Number fall = 0.5 * g * T * T;
  return {p.at("x1") + p.at("vx1") * T - j * nx / m1 * rest,
          p.at("y1") + p.at("vy1") * T - j * ny / m1 * rest - fall,
          p.at("x2") + p.at("vx2") * T + j * nx / m2 * rest,
          p.at("y2") + p.at("vy2") * T + j * ny / m2 * rest - fall,
          p.at("vx1") - j * nx / m1,
          p.at("vy1") - j * ny / m1 - g * T,
          p.at("vx2") + j * nx / m2,
          p.at("vy2") + j * ny / m2 - g * T};
}

std::vector<Number> ExactThreeBalls(const NumberMap& p) {
  Number x[3] = {p.at("x1"), p.at("x2"), p.at("x3")};
  Number v[3] = {p.at("v1"), p.at("v2"), p.at("v3")};
  const Number m[3] = {p.at("m1"), p.at("m2"), p.at("m3")};
  const Number e[2] = {p.at("e12"), p.at("e23")};
  Number left = p.at("T");
  for (;;) {
    int next = -1;
    Number wait(0.0);
    for (int k = 0; k < 2; ++k) {
      const Number approach = v[k] - v[k + 1];
      if (!(approach.a > 0.0)) continue;
      const Number t = (x[k + 1] - x[k] - 2.0 * p.at("r")) / approach;
      if (t.a < left.a && (next < 0 || t.a < wait.a)) {
        next = k;
        wait = t;
      }
    }
    if (next < 0) break;
    for (int k = 0; k < 3; ++k) x[k] += wait * v[k];
    left -= wait;
    const Number j =
        (1.0 + e[next]) * (v[next] - v[next + 1]) / (1.0 / m[next] + 1.0 / m[next + 1]);
    v[next] -= j / m[next];
    v[next + 1] += j / m[next + 1];
  }
  for (int k = 0; k < 3; ++k) x[k] += left * v[k];
  return {x[0], x[1], x[2], v[0], v[1], v[2]};
}

std::vector<Number> ExactFrictionalImpact(const NumberMap& p) {
  const Number &r = p.at("r"), &m = p.at("m"), &I = p.at("I"), &g = p.at("g"), &T = p.at("T");
  const Number c = p.at("y0") - r;
  const Number t = TimeToReach(c, p.at("vy0"), -g);
  const Number down = g * t - p.at("vy0");  // speed of the impact
  const Number jn = (1.0 + p.at("e")) * m * down;
  const Number slip = p.at("vx0") + p.at("w0") * r;
  Number jt = -slip / (1.0 / m + r * r / I);
  const Number most = p.at("mu") * jn;
  if (std::abs(jt.a) > most.a) jt = slip.a > 0.0 ? -most : most;
  const Number rest = T - t;
  const Number up = p.at("e") * down;
  return {p.at("x0") + p.at("vx0") * T + jt / m * rest,
          r + up * rest - 0.5 * g * rest * rest,
          p.at("th0") + p.at("w0") * T + r * jt / I * rest,
          p.at("vx0") + jt / m,
          up - g * rest,
          p.at("w0") + r * jt / I};
}

}  // namespace

ClosedForm Drop(const std::string& name, const Inputs& inputs) {
  ClosedForm form{name,
                  Kind::kBallistic,
                  Take(inputs, {"y0", "v0", "e", "g", "r", "T"}),
                  {"y_T", "v_T"},
                  &ExactDrop,
                  kDiscAndPlane,
                  {},
                  {}};
  form.exact = [](const NumberMap& p) {
    std::vector<Number> outputs = ExactDrop(p);
    if (p.at("e").a == 0.0) DropDerivative(p.at("e"), &outputs);  // no negative side
    return outputs;
  };
  form.numbers = [](const NumberMap& p) {
    return std::vector<std::pair<std::string, Number>>{{"bodies/ball/position/y", p.at("y0")},
                                                       {"bodies/ball/velocity/y", p.at("v0")},
                                                       {"bodies/ball/shape/radius", p.at("r")},
                                                       {"pairs/ball:plane/restitution", p.at("e")},
                                                       {"gravity/y", -p.at("g")}};
  };
  form.read = [](const NumberMap&, const FinalState& s) { return std::vector<Number>{s[1], s[4]}; };
  return form;
}

ClosedForm ObliqueWall(const std::string& name, const Inputs& inputs) {
  ClosedForm form{name,
                  Kind::kBallistic,
                  Take(inputs, {"x0", "y0", "vx0", "vy0", "e", "phi", "d", "r", "g", "T"}),
                  {"x_T", "y_T", "vx_T", "vy_T"},
                  &ExactWall,
                  kDiscAndPlane,
                  {},
                  {}};
  form.numbers = [](const NumberMap& p) {
    return std::vector<std::pair<std::string, Number>>{
        {"bodies/ball/position/x", p.at("x0")},
        {"bodies/ball/position/y", p.at("y0")},
        {"bodies/ball/velocity/x", p.at("vx0")},
        {"bodies/ball/velocity/y", p.at("vy0")},
        {"bodies/ball/shape/radius", p.at("r")},
        {"bodies/plane/shape/normal/x", cos(p.at("phi"))},
        {"bodies/plane/shape/normal/y", sin(p.at("phi"))},
        {"bodies/plane/shape/offset", p.at("d")},
        {"pairs/ball:plane/restitution", p.at("e")},
        {"gravity/y", -p.at("g")}};
  };
  form.read = [](const NumberMap&, const FinalState& s) {
    return std::vector<Number>{s[0], s[1], s[3], s[4]};
  };
  return form;
}

ClosedForm TwoDiscs(const std::string& name, const Inputs& inputs) {
  ClosedForm form{name,
                  Kind::kBallistic,
                  Take(inputs, {"m1", "m2", "e", "r1", "r2", "x1", "y1", "x2", "y2", "vx1", "vy1",
                                "vx2", "vy2", "g", "T"}),
                  {"x1_T", "y1_T", "x2_T", "y2_T", "vx1_T", "vy1_T", "vx2_T", "vy2_T"},
                  &ExactDiscs,
                  kDiscs,
                  {},
                  {}};
  form.numbers = [](const NumberMap& p) {
    std::vector<std::pair<std::string, Number>> numbers = {{"pairs/a:b/restitution", p.at("e")},
                                                           {"gravity/y", -p.at("g")}};
    const std::string bodies[2][2] = {{"1", "bodies/a/"}, {"2", "bodies/b/"}};
    for (const auto& [k, body] : bodies) {
      numbers.emplace_back(body + "mass", p.at("m" + k));
      numbers.emplace_back(body + "shape/radius", p.at("r" + k));
      numbers.emplace_back(body + "position/x", p.at("x" + k));
      numbers.emplace_back(body + "position/y", p.at("y" + k));
      numbers.emplace_back(body + "velocity/x", p.at("vx" + k));
      numbers.emplace_back(body + "velocity/y", p.at("vy" + k));
    }
    return numbers;
  };
  form.read = [](const NumberMap&, const FinalState& s) {
    return std::vector<Number>{s[0], s[1], s[6], s[7], s[3], s[4], s[9], s[10]};
  };
  return form;
}

ClosedForm ThreeBalls(const std::string& name, const Inputs& inputs) {
  ClosedForm form{
      name,
      Kind::kBallistic,
      Take(inputs, {"m1", "m2", "m3", "e12", "e23", "r", "x1", "x2", "x3", "v1", "v2", "v3", "T"}),
      {"x1_T", "x2_T", "x3_T", "v1_T", "v2_T", "v3_T"},
      &ExactThreeBalls,
      kThreeBalls,
      {},
      {}};
  form.numbers = [](const NumberMap& p) {
    std::vector<std::pair<std::string, Number>> numbers = {{"pairs/a:b/restitution", p.at("e12")},
                                                           {"pairs/b:c/restitution", p.at("e23")}};
    const std::string bodies[3][2] = {{"1", "bodies/a/"}, {"2", "bodies/b/"}, {"3", "bodies/c/"}};
    for (const auto& [k, body] : bodies) {
      numbers.emplace_back(body + "mass", p.at("m" + k));
      numbers.emplace_back(body + "shape/radius", p.at("r"));
      numbers.emplace_back(body + "position/x", p.at("x" + k));
      numbers.emplace_back(body + "velocity/x", p.at("v" + k));
    }
    return numbers;
  };
  form.read = [](const NumberMap&, const FinalState& s) {
    return std::vector<Number>{s[0], s[6], s[12], s[3], s[9], s[15]};
  };
  return form;
}

ClosedForm FrictionalImpact(const std::string& name, const Inputs& inputs) {
  ClosedForm form{
      name,
      Kind::kBallistic,
      Take(inputs, {"x0", "y0", "th0", "vx0", "vy0", "w0", "e", "mu", "g", "r", "m", "I", "T"}),
      {"x_T", "y_T", "th_T", "vx_T", "vy_T", "w_T"},
      &ExactFrictionalImpact,
      kDiscAndPlane,
      {},
      {}};
  form.numbers = [](const NumberMap& p) {
    return std::vector<std::pair<std::string, Number>>{
        {"bodies/ball/position/x", p.at("x0")},    {"bodies/ball/position/y", p.at("y0")},
        {"bodies/ball/angle", p.at("th0")},        {"bodies/ball/velocity/x", p.at("vx0")},
        {"bodies/ball/velocity/y", p.at("vy0")},   {"bodies/ball/angular_velocity", p.at("w0")},
        {"bodies/ball/shape/radius", p.at("r")},   {"bodies/ball/mass", p.at("m")},
        {"bodies/ball/inertia", p.at("I")},        {"pairs/ball:plane/restitution", p.at("e")},
        {"pairs/ball:plane/friction", p.at("mu")}, {"gravity/y", -p.at("g")}};
  };
  form.read = [](const NumberMap&, const FinalState& s) { return s; };
  return form;
}

}  // namespace tangible::closed_forms
