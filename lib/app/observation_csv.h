// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Noisy observations of a run: positions of bodies, or of points fixed in them, at a given rate.
//
//   observed = position + sigma g,   g standard normal, independent for x and y of every row
//
// Between steps poses, angles included, are linear in time, which is exact for the map of
// semi-implicit Euler; a point moves with the interpolated pose. The normal numbers are Box and
// Muller's from std::mt19937_64, so that a seed gives the same file with every standard library.

#include <random>
#include <string>
#include <vector>

#include "tangible/dynamics/model/model.h"
#include "tangible/dynamics/model/tolerances.h"

namespace tangible {

/// An observed point of a body (in its frame, m).
struct ObservedPoint {
  std::string name;
  int body = -1;
  Vector2<double> at = Vector2<double>::Zero();
};

struct ObserveOptions {
  std::vector<ObservedPoint> points;  ///< empty: the centre of mass of each moving body
  double rate = 0.0;                  ///< Hz; 0: at every step
  double noise = 0.0;                 ///< m, standard deviation
  unsigned long seed = 0;
};

/// Reads {"tip": {"body": "link9", "at": [0, -0.5]}}; `at` may be absent. Returns an error (one
/// line) or empty.
std::string ReadPoints(const std::string& file, const ModelStructure& structure,
                       std::vector<ObservedPoint>* points);

/// Rows time,body,x,y, or time,point,x,y where points are given.
class ObservationCsv {
 public:
  ObservationCsv(const ModelStructure& structure, ObserveOptions options);
  /// Every state of the run, in order.
  void Add(long k, double t, const State<double>& state);
  /// Whether the state at time t, which will be added next, adds rows.
  bool Writes(double t) const;
  std::string Finish() { return std::move(text_); }

 private:
  void Write(double time, const State<double>& before, double part, const State<double>& after);
  double Normal();
  /// A sample this near to a step belongs to that step, because decimal times miss it by rounding.
  double Near() const { return kSameTime * dt_; }

  ObserveOptions options_;
  double duration_;
  double dt_;
  std::mt19937_64 random_;
  std::string text_;
  long next_ = 0;
  double last_time_ = 0.0;
  State<double> last_;
};

}  // namespace tangible
