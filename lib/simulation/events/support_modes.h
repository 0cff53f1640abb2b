// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// What the supports do in a motion between events (dynamics/elements/support.h). A point that
// slides has friction against its velocity. As it comes to rest that direction turns ever faster:
// motions become shorter with its speed, and the last of them, whose speed is next to nothing, has
// the direction of its start, so that the speed along it passes through 0 at an instant
// (support_bounds.h). Then
//
//   a body whose points all rest   stays, or starts in the direction of its acceleration
//   a body that turns about one    keeps it while |f_i| ≤ μ N_i, or lets that point start
//
// The first is the problem of a step, of accelerations in the place of twists.
//
// A body that starts has that direction for its friction as long as it is slow: friction would
// align its velocity with it within a time that is short beside dt.

#include <vector>

#include "tangible/simulation/events/segment_flow.h"
#include "tangible/simulation/events/support_iteration.h"

namespace tangible {

class SupportModes {
 public:
  /// A step begins at t.
  void StartStep(const ModelStructure& structure, double t);
  /// What the event that ended the last motion has found: support k comes to rest, or lets go.
  void TakeEvent(const Segment& segment);
  /// The last motion has been made, of a length of 0 or not: what an event lets go stays so at its
  /// instant, in which others may let go too.
  void Moved(bool has_length);
  /// The twists of what is held are those of rest.
  void Stopped();

  /// Sets what the supports do in a motion from segment->before, by their speeds there. Speeds up
  /// to `slow` count as 0, m/s.
  void Begin(const Model<double>& model, double slow, Segment* segment);
  /// Whether that is consistent with the accelerations at the start, which were solved with it; if
  /// it is not, changes it in segment->before.
  bool Accept(const Model<double>& model, const ContactProblem<double>& problem,
              const ContactSolution<double>& solution, Segment* segment);
  /// After accelerations that are not found with what is held at rest, as where a joint turns the
  /// body about its pivot at a small rate: lets go what is held, a few times in a motion, or lets
  /// it slide on by its velocity. False where nothing is held.
  bool LetGo(const Model<double>& model, State<double>* before);
  /// After friction of bodies at rest that does not settle, as where a slow body is held by a joint
  /// that still slides: slow bodies slide on by their velocities. False where there are none, or it
  /// may yet settle.
  bool GoOnInstead(const Model<double>& model, State<double>* before);
  bool has_given_up() const { return changes_ > kMostChanges || iteration_.has_given_up(); }
  /// Which support has not been accepted.
  int unsettled() const { return unsettled_; }

  /// Whether a body begins the motion at rest: one with a support that is, or one that does not
  /// move at all.
  bool IsAtRest(const Model<double>& model, const State<double>& before, int body) const;
  /// Whether a body that is held in the motion, or its point, still has a speed at its start that
  /// must be taken from it.
  bool HasToStop(const Model<double>& model, const Segment& segment) const;
  /// Whether a body that is slow, and not at rest, is held while its friction is sought.
  bool HoldsStarting(const Segment& segment) const;
  /// Shortens the motion to what its supports allow, to a multiple of dt / 2^k since the start of
  /// the step: near states have the same k, so that its end is a given instant and derivatives are
  /// exact. `start`: the accelerations at its start.
  void Shorten(const Model<double>& model, SolvedNode* start, Segment* segment);

 private:
  static constexpr int kMostChanges = 150;
  static constexpr int kMostLetGo = 3;
  static constexpr int kMostOfSlow = 12;  ///< changes where a body is slow, and need not be at rest
  static constexpr int kMostOfCreeping = 40;  ///< and where one creeps
  static constexpr int kMostGoneOn = 5;       ///< times that slow bodies slide on, in a motion

  /// What a support does, and why.
  enum class Course : char {
    kFree,      ///< it has no friction
    kSlides,    ///< by its velocities
    kStops,     ///< a part of it is slow, and slows down
    kStarts,    ///< the body is slow, and begins to move
    kRests,     ///< the body is at rest: it stays, or begins to move
    kTurns,     ///< a point is at rest
    kPasses,    ///< a point is slow, and begins to move or only passes a low speed
    kReleased,  ///< an event has let go what was held
    kShares,    ///< the body is at rest, and others share what its support is at its limit for
    kCreeps,    ///< the body is slow, and hardly changes its speed (SupportState::horizon)
  };
  struct Rested {
    int support = -1;
    int part = SupportState::kNothing;  ///< SupportState::kBody, or the point
  };
  Course CourseOf(const Model<double>& model, int k, double slow, const Segment& segment,
                  SupportState* at);
  Course CourseOfPoints(const SupportIndex& support, double stops, double starts, SupportState* at);
  bool AcceptOne(const Model<double>& model, int k, const ContactSolution<double>& solution,
                 Segment* segment);
  /// Bodies, and points, at rest whose accelerations are 0 although a support is at its limit: what
  /// others take from it holds them all. Whether there are any.
  bool HoldSharing(const Model<double>& model, const ContactSolution<double>& solution,
                   Segment* segment);
  bool AcceptPoint(int point, const double acceleration[3], double turn, const double* held,
                   int* changes, SupportState* at) const;
  /// Seeks the friction of a support, or of a point of it that is at rest.
  void Seek(int k, int part, SupportState* at);
  long NumSought() const;
  bool HasBegun(int k) const {
    return courses_[k] == Course::kStarts || courses_[k] == Course::kPasses;
  }
  bool StartsAlong(const Model<double>& model, int k, const State<double>& before) const;
  bool AcceptAll(const Model<double>& model, const ContactProblem<double>& problem,
                 const ContactSolution<double>& solution, Segment* segment);
  /// Of bodies that joints or contacts connect to others and that slide by their velocities: seeks
  /// the friction of those that creep. Whether there are any.
  bool FindCreeping(const Model<double>& model, const ContactSolution<double>& solution,
                    Segment* segment);
  /// Seeks it from a guess of its accelerations, 3; then of all that is sought from what is known.
  void SeekCreeping(const Model<double>& model, int k, const double* acceleration,
                    State<double>* before);
  void StartAtGuess(const Model<double>& model, const State<double>& before);
  /// Friction with which a creeping body has stopped after its horizon: seeks that of a shorter
  /// one, or else stops it along its direction.
  void ShortenHorizon(const Model<double>& model, int k, State<double>* before);
  void GoOn(const Model<double>& model, int k, State<double>* before);
  /// By all of its velocities, without what is sought of it.
  void SlideOn(int k, SupportState* at);
  double LongestOf(const Model<double>& model, int k, const Segment& segment, SolvedNode* start);
  double ShareOfDecay(const Model<double>& model, int k, const Segment& segment, SolvedNode* start);

  double start_ = 0.0;  ///< of the step
  double dt_ = 0.0;
  int changes_ = 0;
  int times_gone_on_ = 0;
  int times_let_go_ = 0;  ///< without accelerations, in this motion
  int unsettled_ = -1;
  bool started_ = false;  ///< the iteration of bodies at rest
  std::vector<Course> courses_;
  std::vector<int> sought_;  ///< what is sought of each support, by SupportState::Holds
  std::vector<char> turns_;  ///< the support is at rest, and the body turns about its only point
  /// Friction of a body that starts has not settled in this step: it slides on by its velocity.
  std::vector<char> unsettled_start_;
  std::vector<double> speeds_, last_speeds_;  ///< of supports, in this motion and the one before
  bool may_creep_ = true;                     ///< in this motion: those that do have settled
  std::vector<double> horizons_;              ///< of those that creep, s; 0: of others
  std::vector<int> turned_;  ///< how often the direction of a support has been changed
  std::vector<Rested> rested_;
  std::vector<SupportState> let_go_;  ///< by support; `slow` is kNothing: it is not let go
  ContactProblem<double> pushed_;     ///< masses and what pushes bodies that are at rest
  SupportFriction friction_;
  SupportIteration iteration_;
  std::vector<double> response_;  ///< of the start's system to a unit force
};

}  // namespace tangible
