// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// What a shard of tangible-verify keeps of a job (app/row_archive.h): all of it. A structured
// binding names all fields, so that the compiler sees where one is left out.

#include "tangible/verification/gradients/verify_run.h"

namespace tangible {

template <typename Visitor>
void VisitFields(CheckedEntry& entry, const Visitor& visit) {
  auto& [output, parameter, pair, error, ratio, values, contributions, ridders_error] = entry;
  visit("output", output);
  visit("parameter", parameter);
  visit("pair", pair);
  visit("error", error);
  visit("ratio", ratio);
  visit("values", values);
  visit("contributions", contributions);
  visit("ridders_error", ridders_error);
}

template <typename Visitor>
void VisitFields(CheckedException& exception, const Visitor& visit) {
  auto& [parameter, pair, entries, error, what, named, other_solution] = exception;
  visit("parameter", parameter);
  visit("pair", pair);
  visit("entries", entries);
  visit("error", error);
  visit("what", what);
  visit("named", named);
  visit("other_solution", other_solution);
}

template <typename Visitor>
void VisitFields(KindRow& row, const Visitor& visit) {
  auto& [kind, parameters, entries, error, coarse, named, other_solution, unexplained,
         zero_columns] = row;
  visit("kind", kind);
  visit("parameters", parameters);
  visit("entries", entries);
  visit("error", error);
  visit("coarse", coarse);
  visit("named", named);
  visit("other_solution", other_solution);
  visit("unexplained", unexplained);
  visit("zero_columns", zero_columns);
}

template <typename Visitor>
void VisitFields(ValidityRadius& radius, const Visitor& visit) {
  auto& [parameter, down, up, down_where, up_where] = radius;
  visit("parameter", parameter);
  visit("down", down);
  visit("up", up);
  visit("down_where", down_where);
  visit("up_where", up_where);
}

template <typename Visitor>
void VisitFields(Certificate& certificate, const Visitor& visit) {
  auto& [margin_min, margin_where, degenerate_rows, redundant_rows, condition, linear_residual,
         mode_switches, events, bounces_ended, fallbacks, coordinates, one_sided, discontinuous,
         discrete_map, discrete_impact, radius, growth, verdict] = certificate;
  visit("margin_min", margin_min);
  visit("margin_where", margin_where);
  visit("degenerate_rows", degenerate_rows);
  visit("redundant_rows", redundant_rows);
  visit("condition", condition);
  visit("linear_residual", linear_residual);
  visit("mode_switches", mode_switches);
  visit("events", events);
  visit("bounces_ended", bounces_ended);
  visit("fallbacks", fallbacks);
  visit("coordinates", coordinates);
  visit("one_sided", one_sided);
  visit("discontinuous", discontinuous);
  visit("discrete_map", discrete_map);
  visit("discrete_impact", discrete_impact);
  visit("radius", radius);
  visit("growth", growth);
  visit("verdict", verdict);
}

template <typename Visitor>
void VisitFields(SceneCheck& check, const Visitor& visit) {
  auto& [name, replay, stepping, done, message, bodies, joints, parameters, steps, certificate,
         missing, unrolled_fallbacks, closed, sliding, sticking, limits, impacts, recoveries, rows,
         total, worst, exceptions, wrong_value, false_alarms, outputs, parameter_paths, jacobian,
         contributions, ridders_error] = check;
  visit("name", name);
  visit("replay", replay);
  visit("stepping", stepping);
  visit("done", done);
  visit("message", message);
  visit("bodies", bodies);
  visit("joints", joints);
  visit("parameters", parameters);
  visit("steps", steps);
  visit("certificate", certificate);
  visit("missing", missing);
  visit("unrolled_fallbacks", unrolled_fallbacks);
  visit("closed", closed);
  visit("sliding", sliding);
  visit("sticking", sticking);
  visit("limits", limits);
  visit("impacts", impacts);
  visit("recoveries", recoveries);
  visit("rows", rows);
  visit("total", total);
  visit("worst", worst);
  visit("exceptions", exceptions);
  visit("wrong_value", wrong_value);
  visit("false_alarms", false_alarms);
  visit("outputs", outputs);
  visit("parameter_paths", parameter_paths);
  visit("jacobian", jacobian);
  visit("contributions", contributions);
  visit("ridders_error", ridders_error);
}

template <typename Visitor>
void VisitFields(CheckedJob& job, const Visitor& visit) {
  auto& [check, coverage] = job;
  visit("check", check);
  visit("coverage", coverage);
}

}  // namespace tangible
