// SPDX-License-Identifier: Apache-2.0
#include "tangible/app/trajectory_csv.h"

#include <cmath>
#include <unordered_map>

#include "tangible/app/program.h"
#include "tangible/scene/csv.h"
#include "tangible/scene/json_reader.h"
#include "tangible/simulation/certificate/certify.h"

namespace tangible {

TrajectoryCsv::TrajectoryCsv(const ModelStructure& structure, long every)
    : structure_(structure), every_(every), text_("time,body,x,y,angle,vx,vy,omega\n") {}

void TrajectoryCsv::Add(long k, double t, const State<double>& state) {
  pending_ = !Writes(k);
  if (!pending_) {
    Write(t, state);
    return;
  }
  last_time_ = t;
  last_ = state;
}

void TrajectoryCsv::Write(double t, const State<double>& state) {
  const std::string time = FormatNumber(t);
  for (int body = 0; body < structure_.world(); ++body) {
    if (structure_.bodies[body].motion == Motion::kStatic) {
      continue;
    }
    text_ += time;
    text_ += ',';
    text_ += structure_.bodies[body].name;
    for (const std::vector<double>* numbers : {&state.pose, &state.twist}) {
      for (int i = 0; i < 3; ++i) {
        text_ += ',';
        AppendNumber((*numbers)[3 * body + i], &text_);
      }
    }
    text_ += '\n';
  }
}

std::string TrajectoryCsv::Finish() {
  if (pending_) {
    Write(last_time_, last_);
    pending_ = false;
  }
  return std::move(text_);
}

ContactsCsv::ContactsCsv()
    : text_(
          "time,kind,first,second,gap,normal_impulse,tangential_impulse,mode,"
          "impulse_1,impulse_2,impulse_3\n") {}

void ContactsCsv::Add(const ModelStructure& structure, double t, const StepRecord& record) {
  const std::string time = FormatNumber(t);
  for (size_t i = 0; i < record.contacts.size(); ++i) {
    const ActiveContact& contact = record.contacts[i];
    const bool is_friction = contact.IsPureFriction();  // which has no normal impulse
    const std::string names =
        contact.is_rolling ? ",rolling," + structure.bodies[contact.a].name + "," +
                                 structure.bodies[contact.b].name + ","
        : contact.is_motor   ? ",motor," + structure.joints[contact.joint].name + ",,"
        : is_friction        ? ",friction," + structure.joints[contact.joint].name + ",,"
        : contact.joint >= 0 ? ",limit," + structure.joints[contact.joint].name +
                                   (contact.side > 0.0 ? ",low," : ",high,")
                             : ",contact," + structure.bodies[contact.a].name + "," +
                                   structure.bodies[contact.b].name + ",";
    text_ += time + names + FormatNumber(contact.gap) + "," +
             FormatNumber(is_friction ? 0.0 : record.solution.normal_impulse[i]) + "," +
             FormatNumber(record.solution.tangent_impulse[i]) + "," +
             ModeName(record.solution.modes[i]) + ",,,\n";
  }
  for (size_t j = 0; j < structure.joints.size(); ++j) {
    const JointIndex& joint = structure.joints[j];
    text_ += time + ",joint," + joint.name + ",,,,,";
    for (int k = 0; k < 3; ++k) {
      text_ += k < joint.rows ? "," + FormatNumber(record.solution.joint_impulse[3 * j + k]) : ",";
    }
    text_ += "\n";
  }
}

bool ReadInitialState(const std::string& file, const ModelStructure& structure,
                      State<double>* state, std::string* error) {
  const std::vector<std::string> columns = {"time", "body", "x", "y", "angle", "vx", "vy", "omega"};
  CsvTable table;
  if (!ReadCsv(file, columns, columns, &table, error)) {
    return false;
  }
  if (table.rows.empty()) {
    *error = file + ": expected at least one row, got none";
    return false;
  }
  std::unordered_map<std::string, int> bodies;
  for (int body = 0; body < structure.world(); ++body) {
    if (structure.bodies[body].motion != Motion::kStatic) {
      bodies.emplace(structure.bodies[body].name, body);
    }
  }
  for (int row = 0; row < static_cast<int>(table.rows.size()); ++row) {
    const std::string& name = table.rows[row][table.Column("body")];
    const auto found = bodies.find(name);
    if (found == bodies.end()) {
      *error = file + ": line " + std::to_string(table.lines[row]) +
               ": body: expected a moving or kinematic body of the scene, got " + Describe(name);
      return false;
    }
    const int body = found->second;
    double time = 0.0;
    bool good = ReadCell(table, row, table.Column("time"), &time, error);
    for (int i = 0; i < 3; ++i) {
      good = good &&
             ReadCell(table, row, table.Column(columns[2 + i]), &state->pose[3 * body + i], error);
      good = good &&
             ReadCell(table, row, table.Column(columns[5 + i]), &state->twist[3 * body + i], error);
    }
    if (!good) {
      return false;
    }
  }
  return true;
}

std::string CheckInitialState(const ModelStructure& structure, const State<double>& state) {
  for (int body = 0; body < structure.num_bodies(); ++body) {
    for (int i = 0; i < 3; ++i) {
      if (!std::isfinite(state.pose[3 * body + i]) || !std::isfinite(state.twist[3 * body + i])) {
        return "body " + structure.bodies[body].name +
               ": expected a finite pose and twist at time 0, got joints' or its own numbers that "
               "are too large";
      }
    }
  }
  return "";
}

}  // namespace tangible
