// SPDX-License-Identifier: Apache-2.0
//
// tangible-closed-forms: values and derivatives of the engine against motions known in closed form.

#include <gflags/gflags.h>

#include <cstdio>
#include <string>
#include <vector>

#include "tangible/app/program.h"
#include "tangible/verification/closed_forms/report.h"

DEFINE_string(out, "", "file of all errors (JSON); empty: none");
DEFINE_string(picture, "", "file of a picture of errors over dt (SVG); empty: none");

namespace tangible {
namespace {

int Main(int argc, char** argv) {
  const CommandLine line = ParseCommandLine(
      argc, argv,
      {.name = "tangible-closed-forms",
       .synopsis = "[--out=R.json] [--picture=P.svg]",
       .description = "Compares fixed and event stepping with motions known in closed form: errors "
                      "of values and derivatives\nwith the smallest of five time steps, and the "
                      "order at which those of the derivatives fall.",
       .version = TANGIBLE_VERSION,
       .source_file = __FILE__,
       .num_positional = 0,
       .outputs = {"out", "picture"}});
  if (line.exit_status) return *line.exit_status;
  const std::vector<closed_forms::Study> studies = closed_forms::RunAllStudies();
  std::fputs(closed_forms::TableText(studies).c_str(), stdout);
  ResultWriter writer;
  writer.Write(FLAGS_out, [&] { return JsonText(closed_forms::ToJson(studies)); });
  writer.Write(FLAGS_picture, [&] { return closed_forms::Picture(studies); });
  if (!writer.error().empty()) return ReportError(writer.error());
  const std::vector<std::string> broken = closed_forms::BrokenBounds(studies);
  return broken.empty() ? kExitDone : ReportError(broken[0]);
}

}  // namespace
}  // namespace tangible

int main(int argc, char** argv) { return tangible::RunMain(&tangible::Main, argc, argv); }
