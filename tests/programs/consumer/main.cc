// SPDX-License-Identifier: Apache-2.0
//
// What a project needs of the installed package: headers under their names, both kinds of number,
// and libraries that link.

#include <cmath>
#include <cstdio>
#include <string>

#include "tangible/math/planar.h"
#include "tangible/math/scalar.h"
#include "tangible/render/plot.h"
#include "tangible/render/view.h"

int main() {
  using tangible::Jet;
  const tangible::Pose<Jet<1>> pose({Jet<1>(1.0), Jet<1>(2.0)}, Jet<1>(0.5, 0));
  const tangible::Vector2<Jet<1>> point =
      pose * tangible::Vector2<Jet<1>>(Jet<1>(3.0), Jet<1>(0.0));
  if (std::abs(point.x().v[0] + 3.0 * std::sin(0.5)) > 1e-15) {
    std::fprintf(stderr, "d(1 + 3 cos a)/da at 0.5 is %.17g\n", point.x().v[0]);
    return 1;
  }
  tangible::ViewData view;
  view.name = "consumer";
  const std::string html = tangible::ViewHtml(view);
  const std::string svg = tangible::PlotSvg({}, {{"line", {0.0, 1.0}, {0.0, 1.0}, {}, {}}});
  if (html.find("consumer") == std::string::npos || svg.find("<svg") != 0) {
    std::fputs("the page or the plot is not what was asked for\n", stderr);
    return 1;
  }
  std::puts("consumer: ok");
  return 0;
}
