// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/gradients/scene_check.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <utility>

#include "tangible/math/scalar.h"
#include "tangible/simulation/stepping/step.h"

namespace tangible {
namespace {

constexpr double kRounding = 1e-13;  // of the contributions
constexpr double kShareOfColumn = 0.1;
constexpr double kInteriorPointEnd = 1e-14;
// Of that: derivatives in Jets are those of the last iteration but one, whose products z s are
// larger by two orders.
constexpr double kLagOfJets = 100.0;
// Of the column: the rounding of a coincidence, over the step of the closed form's differences; the
// engine's moments, which are located to 1e-10 of forces and 1e-12 of sizes, and contributions,
// which do not include what moves an event's time and cancels in other bodies.
constexpr double kCoincidenceRounding = 1e-9;
// Of the column's contributions: plain quotients that differ from the tangent by less confirm it.
constexpr double kConfirmedByQuotients = 1e-5;

std::string Short(double x) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.9g", x);
  return text;
}

// NaN is no error.
double Larger(double a, double b) { return std::isnan(a) || b > a ? b : a; }

class Judge {
 public:
  Judge(const MethodJacobians& run, const std::vector<ParameterPath>& parameters, SceneCheck* check)
      : run_(run), parameters_(parameters), check_(*check) {}

  void JudgeAll() {
    JudgeValues();
    std::map<std::string, KindRow> rows;
    for (int p = 0; p < static_cast<int>(parameters_.size()); ++p) {
      KindRow row;
      row.kind = KindOf(parameters_[p].path);
      row.parameters = 1;
      row.entries = static_cast<long>(run_.outputs.size());
      if ((run_.jacobian[kByTangent].col(p).array() == 0.0).all()) {
        row.zero_columns.push_back(parameters_[p].path);
      }
      CountCoarse(p, &row);
      for (int pair = 0; pair < kNumPairs; ++pair) {
        JudgeColumn(p, pair, &row);
      }
      JudgeSides(p, &row);
      auto [found, is_new] = rows.try_emplace(row.kind, row);
      if (!is_new) {
        found->second.Add(row);
      }
    }
    check_.total.kind = "all";
    for (auto& [kind, row] : rows) {
      check_.total.Add(row);
      check_.rows.push_back(std::move(row));
    }
  }

 private:
  // Whether the run ends where the closed form ends.
  void JudgeValues() {
    const VectorX<double>& known = run_.known_values;
    if (known.size() == 0 || known.size() != run_.trace.values.size()) return;
    const auto apart = (known - run_.trace.values).cwiseAbs();
    Eigen::Index output = 0;
    const double most = apart.maxCoeff(&output);
    if (most > run_.closed_form_tolerance * std::max(1.0, known.cwiseAbs().maxCoeff())) {
      check_.wrong_value = run_.outputs[static_cast<size_t>(output)] + " ends at " +
                           Short(run_.trace.values[output]) + ", in closed form at " +
                           Short(known[output]);
    }
  }

  void CountCoarse(int p, KindRow* row) const {
    if (run_.differences[p].status != DifferenceStatus::kJudged) {
      return;
    }
    const double largest = run_.jacobian[kByTangent].col(p).cwiseAbs().maxCoeff();
    for (Eigen::Index o = 0; o < run_.jacobian[kByRidders].rows(); ++o) {
      row->coarse +=
          IsCoarse(run_.jacobian[kByRidders](o, p), run_.differences[p].errors[o], largest) ? 1 : 0;
    }
  }

  void JudgeColumn(int p, int pair, KindRow* row) {
    const MethodPair& methods = kMethodPairs[pair];
    if (run_.jacobian[methods.a].size() == 0 || run_.jacobian[methods.b].size() == 0) {
      JudgeMissing(p, pair, row);
      return;
    }
    if (methods.a == kByRidders && run_.differences[p].status != DifferenceStatus::kJudged) {
      const bool failed = run_.differences[p].status == DifferenceStatus::kRunFailed;
      if (!failed && Reason(p, pair).empty() && PlainQuotientsAgree(p)) return;
      Except(p, pair, row->entries, kInfinity,
             (failed ? "a changed run fails: " : "choices differ at p +- h: ") +
                 run_.differences[p].where,
             row);
      return;
    }
    CheckedException exception;
    for (int o = 0; o < static_cast<int>(run_.outputs.size()); ++o) {
      const CheckedEntry entry = Entry(o, p, pair);
      if (!methods.bounded && std::isnan(entry.error)) {
        continue;  // no quotient of this step, as choices differ
      }
      if ((IsKnownMethod(methods.a) && std::isnan(run_.jacobian[methods.a](o, p))) ||
          (IsOfASide(methods.a) && std::isnan(run_.jacobian[methods.b](o, p)))) {
        continue;
      }
      if (!methods.bounded || entry.ratio <= 1.0) {
        row->error[pair] = Larger(row->error[pair], entry.error);
        AddWorst(entry);
        continue;
      }
      ++exception.entries;
      if (entry.error > exception.error || exception.entries == 1) {
        exception.error = entry.error;
        exception.what =
            entry.output + ": " + Short(entry.values[methods.a]) + " against " +
            Short(entry.values[methods.b]) + ", contributions " + Short(entry.contributions) +
            (methods.a == kByRidders ? ", estimated error " + Short(entry.ridders_error) : "");
      }
      if (Reason(p, pair).empty()) {
        row->error[pair] = Larger(row->error[pair], entry.error);
        AddWorst(entry);
      }
    }
    if (exception.entries > 0) {
      Except(p, pair, exception.entries, exception.error, exception.what, row);
    }
  }

  // Whether the quotients of both plain steps confirm the tangent of a column although choices
  // differ: of contacts without force, or that share one, whose modes move nothing.
  bool PlainQuotientsAgree(int p) const {
    const double tolerance = kConfirmedByQuotients * ScaleOfColumn(p);
    return std::all_of(
        std::begin(run_.differences[p].plain), std::end(run_.differences[p].plain),
        [&](const PlainDifference& plain) {
          return plain.values.size() == run_.jacobian[kByTangent].rows() &&
                 (plain.values - run_.jacobian[kByTangent].col(p)).cwiseAbs().maxCoeff() <=
                     tolerance;
        });
  }

  static bool IsOfASide(Method method) { return method == kByPlus || method == kByMinus; }
  // Entries of these may be unknown.
  static bool IsKnownMethod(Method method) { return method == kByClosedForm || IsOfASide(method); }

  // Whether the certificate names a kink where the closed form has one, and only there.
  void JudgeSides(int p, KindRow* row) {
    if (run_.jacobian[kByClosedPlus].size() == 0) return;
    // Where an output jumps on a side, its derivative there is NaN.
    const VectorX<double> difference =
        run_.jacobian[kByClosedPlus].col(p) - run_.jacobian[kByClosedMinus].col(p);
    const VectorX<double> apart =
        difference.array().isNaN().select(kInfinity, difference.array().abs()).matrix();
    Eigen::Index output = 0;
    const double most = apart.maxCoeff(&output);
    const bool has_kink = most > run_.closed_form_tolerance * ScaleOfColumn(p);
    if (!has_kink && !run_.named[p].empty()) {
      check_.false_alarms.push_back(parameters_[p].path + ": " + run_.named[p]);
    }
    if (has_kink && run_.named[p].empty()) {
      const auto closed = static_cast<int>(
          std::find_if(std::begin(kMethodPairs), std::end(kMethodPairs),
                       [](const MethodPair& pair) { return pair.a == kByClosedForm; }) -
          std::begin(kMethodPairs));
      Except(p, closed, 1, most / ScaleOfColumn(p),
             run_.outputs[static_cast<size_t>(output)] + ": a kink that is not named, " +
                 Short(run_.jacobian[kByClosedMinus](output, p)) + " below and " +
                 Short(run_.jacobian[kByClosedPlus](output, p)) + " above",
             row);
    }
  }

  // A width of Jets that is not built does not count as an exception; a run that ended because of
  // another solution does.
  void JudgeMissing(int p, int pair, KindRow* row) {
    const MethodPair& methods = kMethodPairs[pair];
    const std::string& why = run_.missing[methods.a];
    if (why.empty() || why.find("no width of Jets") != std::string::npos) {
      return;
    }
    Except(p, pair, row->entries, kInfinity, why, row);
  }

  double Tolerance(int pair) const {
    return kMethodPairs[pair].a == kByClosedForm ? run_.closed_form_tolerance
                                                 : kMethodPairs[pair].tolerance;
  }

  CheckedEntry Entry(int o, int p, int pair) const {
    CheckedEntry entry;
    entry.output = run_.outputs[o];
    entry.parameter = parameters_[p].path;
    entry.pair = pair;
    for (int m = 0; m < kNumMethods; ++m) {
      entry.values[m] = run_.jacobian[m].size() == 0 ? kUnknown : run_.jacobian[m](o, p);
    }
    entry.contributions = std::max(run_.contributions.sum(o, p), kShareOfColumn * ScaleOfColumn(p));
    entry.ridders_error = run_.differences[p].status == DifferenceStatus::kJudged
                              ? run_.differences[p].errors[o]
                              : kUnknown;
    double estimate = kMethodPairs[pair].a == kByRidders ? entry.ridders_error : 0.0;
    if (IsKnownMethod(kMethodPairs[pair].a) && run_.jacobian[kByClosedPlus].size() > 0) {
      estimate = kCoincidenceRounding * ScaleOfColumn(p);
    }
    if (kMethodPairs[pair].a == kByUnrolledJets) {
      entry.contributions = ScaleOfColumn(p);
      const double error = InteriorPointError();
      estimate = error <= Tolerance(pair)
                     ? kLagOfJets * error * static_cast<double>(check_.steps) * entry.contributions
                     : 0.0;
    }
    if (!kMethodPairs[pair].bounded) {
      const double largest = std::max(run_.jacobian[kByTangent].col(p).cwiseAbs().maxCoeff(),
                                      Tolerance(pair) * ScaleOfColumn(p));
      entry.error =
          std::abs(entry.values[kMethodPairs[pair].a] - entry.values[kMethodPairs[pair].b]) /
          largest;
      return entry;
    }
    entry.error = EntryError(entry.values[kMethodPairs[pair].a], entry.values[kMethodPairs[pair].b],
                             Tolerance(pair), entry.contributions, estimate);
    entry.ratio = entry.error / Tolerance(pair);
    return entry;
  }

  // 10 κ / margin²: the relative remaining influence of inactive rows. The margin of friction in a
  // joint is relative to its own limit, which may be a small share of what κ is relative to.
  double InteriorPointError() const {
    const double margin = std::min(run_.certificate.margin_min, run_.friction_share);
    return 10.0 * kInteriorPointEnd / (margin * margin);
  }

  // The largest derivative of the column at any step, and the outputs over the parameter's size.
  double ScaleOfColumn(int p) const {
    const double value = std::abs(parameters_[p].value);
    const double size = value > 0.0 ? value : std::min(parameters_[p].scale, 1.0);
    return std::max(run_.contributions.column[p], run_.trace.values.cwiseAbs().maxCoeff() / size);
  }

  // The certificate's verdict that explains an exception; empty if there is none. One-sided
  // derivatives, and entries on whose derivative both sides agree, have no kink.
  std::string Reason(int p, int pair) const {
    const Method method = kMethodPairs[pair].a;
    const bool is_unique = IsKnownMethod(method) && run_.jacobian[kByClosedPlus].size() > 0;
    if (is_unique && (IsOfASide(method) || !IsEdgeOfFixedSteps(p))) return "";
    if (!run_.named[p].empty()) {
      return run_.named[p];
    }
    if (kMethodPairs[pair].a == kByRidders && run_.certificate.redundant_rows > 0 &&
        run_.differences[p].status == DifferenceStatus::kChoicesDiffer) {
      return std::to_string(run_.certificate.redundant_rows) +
             " redundant rows, whose modes are not unique";
    }
    if (kMethodPairs[pair].a == kByUnrolledJets && InteriorPointError() > Tolerance(pair)) {
      return run_.friction_share < run_.certificate.margin_min
                 ? "friction in a joint changes a speed by " + Short(run_.friction_share) + " of it"
                 : "margin " + Short(run_.certificate.margin_min) + " at " +
                       run_.certificate.margin_where;
    }
    return "";
  }

  // Whether the certificate has named a parameter as an edge of a force's window on a step's end,
  // or at an end of the run.
  // The derivative of fixed steps there is the mean of those of two steps, each of which may pass
  // another kink on its own side: neither side need have the mean, even if both have the same.
  bool IsEdgeOfFixedSteps(int p) const {
    const std::string& named = run_.named[p];
    return check_.stepping == Stepping::kFixed &&
           (named.find("on a step's boundary") != std::string::npos ||
            named.find("is the start of the run") != std::string::npos ||
            named.find("is the end of the run") != std::string::npos);
  }

  void Except(int p, int pair, long entries, double error, const std::string& what, KindRow* row) {
    CheckedException exception;
    exception.parameter = parameters_[p].path;
    exception.pair = pair;
    exception.entries = entries;
    exception.error = error;
    exception.what = what;
    exception.named = Reason(p, pair);
    exception.other_solution =
        exception.named.empty() && what.find("different branch") != std::string::npos;
    (exception.unexplained()    ? row->unexplained
     : exception.other_solution ? row->other_solution
                                : row->named) += entries;
    check_.exceptions.push_back(std::move(exception));
  }

  void AddWorst(const CheckedEntry& entry) {
    if (!kMethodPairs[entry.pair].bounded) {
      return;
    }
    std::vector<CheckedEntry>& worst = check_.worst;
    const auto place = std::upper_bound(
        worst.begin(), worst.end(), entry,
        [](const CheckedEntry& x, const CheckedEntry& y) { return x.ratio > y.ratio; });
    if (place - worst.begin() < kMostWorst) {
      worst.insert(place, entry);
      worst.resize(std::min<size_t>(worst.size(), kMostWorst));
    }
  }

  const MethodJacobians& run_;
  const std::vector<ParameterPath>& parameters_;
  SceneCheck& check_;
};

void Keep(const std::vector<ParameterPath>& parameters, MethodJacobians* run, SceneCheck* check) {
  check->outputs = run->outputs;
  const auto rows = static_cast<Eigen::Index>(run->outputs.size());
  check->ridders_error.setConstant(rows, static_cast<Eigen::Index>(parameters.size()), kUnknown);
  for (size_t p = 0; p < parameters.size(); ++p) {
    check->parameter_paths.push_back(parameters[p].path);
    if (run->differences[p].status == DifferenceStatus::kJudged) {
      check->ridders_error.col(static_cast<Eigen::Index>(p)) = run->differences[p].errors;
    }
  }
  for (int m = 0; m < kNumMethods; ++m) {
    check->jacobian[m] = std::move(run->jacobian[m]);
  }
  check->contributions = std::move(run->contributions.sum);
}

}  // namespace

KindRow::KindRow() { std::fill(std::begin(error), std::end(error), kUnknown); }

void KindRow::Add(const KindRow& other) {
  parameters += other.parameters;
  entries += other.entries;
  for (int pair = 0; pair < kNumPairs; ++pair) {
    if (!std::isnan(other.error[pair])) {
      error[pair] = Larger(error[pair], other.error[pair]);
    }
  }
  coarse += other.coarse;
  named += other.named;
  other_solution += other.other_solution;
  unexplained += other.unexplained;
  zero_columns.insert(zero_columns.end(), other.zero_columns.begin(), other.zero_columns.end());
}

std::string KindOf(const std::string& path) {
  std::string kind;
  size_t start = 0;
  for (int segment = 0; start <= path.size(); ++segment) {
    const size_t end = std::min(path.find('/', start), path.size());
    const std::string word = path.substr(start, end - start);
    start = end + 1;
    const bool is_index = word.find_first_not_of("0123456789") == std::string::npos;
    const bool is_name = segment == 1 && path.rfind("gravity/", 0) != 0;
    if (!is_index && !is_name) {
      kind += (kind.empty() ? "" : "/") + word;
    }
  }
  return kind;
}

double EntryError(double a, double b, double tolerance, double contributions, double estimate) {
  const double off = std::abs(a - b);
  if (off == 0.0) {
    return 0.0;
  }
  const double allowed = std::max(tolerance * std::abs(b), estimate) + kRounding * contributions;
  const double error = tolerance * off / allowed;
  return std::isnan(error) ? kInfinity : error;
}

bool IsCoarse(double value, double estimate, double largest_of_column) {
  constexpr double kResolved = 1e-3;
  return largest_of_column > 0.0 &&
         estimate > kResolved * std::max(std::abs(value), kResolved * largest_of_column);
}

SceneCheck CheckScene(const Scene& scene, const std::vector<ParameterPath>& parameters,
                      KeepJacobians keep, const std::optional<ClosedFormJacobian>& known) {
  SceneCheck check;
  check.name = scene.path.empty() ? scene.name : scene.path;
  check.stepping = scene.simulation.stepping;
  check.joints = static_cast<int>(scene.joints.size());
  check.bodies = static_cast<int>(
      std::count_if(scene.bodies.begin(), scene.bodies.end(),
                    [](const auto& body) { return body.motion == Motion::kMoving; }));
  check.parameters = static_cast<int>(parameters.size());
  check.steps = NumSteps(scene.simulation);
  MethodJacobians run = RunMethods(scene, parameters, known);
  check.done = run.done;
  check.message = run.message;
  if (!run.done) {
    return check;
  }
  check.certificate = run.certificate;
  check.unrolled_fallbacks = run.unrolled_fallbacks;
  std::copy(std::begin(run.missing), std::end(run.missing), std::begin(check.missing));
  check.closed = run.trace.closed;
  check.sliding = run.trace.sliding;
  check.sticking = run.trace.sticking;
  check.limits = run.trace.limits;
  check.impacts = run.trace.impacts;
  check.recoveries = run.trace.recoveries;
  Judge(run, parameters, &check).JudgeAll();
  if (keep == KeepJacobians::kYes) {
    Keep(parameters, &run, &check);
  }
  return check;
}

}  // namespace tangible
