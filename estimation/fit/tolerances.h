// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The tolerances of the minimisation. Each comment names the quantity of which the tolerance is a
// fraction or multiple, then the reason. The README has the table.

namespace tangible {

/// Of sigma: a parameter that moves the vector of residuals by no more, changed by its own
/// magnitude, has no effect.
inline constexpr double kNoEffect = 1e-12;
/// Of the cost and 1: with a larger change a parameter without a derivative changes the residuals
/// by jumps.
inline constexpr double kJumpsBy = 1e-6;
/// Of sigma: an effect of that kind that is smaller may be the rounding of effects that cancel. It
/// is if it changes by kChangesAsRounding of itself where the parameter is moved by kBesideStep of
/// its magnitude.
inline constexpr double kMayBeRounding = 1e-7;
inline constexpr double kBesideStep = 1e-6;
/// Of the largest effect of a parameter, as long as it is below kNotSeen of sigma too: smaller ones
/// are rounding.
inline constexpr double kRoundingBeside = 1e-10;
inline constexpr double kNotSeen = 1e-6;
inline constexpr double kChangesAsRounding = 1e-3;
/// Of the cost: by how much a derivative that may be rounding must change it for that to be seen;
/// and of that change: where the cost changes by less, it is rounding.
inline constexpr double kSeenInCost = 1e-12;
inline constexpr double kShareOfExpected = 0.1;
/// Of the radius of the trust region: where an iteration has ended at values at which no parameter
/// has an effect, it is repeated with a region so much smaller.
inline constexpr double kSmallerRegion = 1e-3;
/// Of sigma², the mean square of residuals: with more, values at which no parameter has an effect
/// are no minimum.
inline constexpr double kLevelExplains = 10.0;
/// Of the cost: minima of two starts whose costs differ by less are the same.
inline constexpr double kSameCost = 1e-6;
/// Of the lower cost, beyond 1 σ²: a minimum that costs more is not the global one.
inline constexpr double kFarAbove = 2.0;
/// Of the cost: Ceres stops where an iteration changes the cost by less; final Gauss-Newton steps
/// go on from there.
inline constexpr double kFunctionTolerance = 1e-10;
/// Of the length of q: Ceres stops where an iteration changes q by less; a final step that is
/// shorter and does not shrink to half of the last one is rounding.
inline constexpr double kParameterTolerance = 1e-9;
/// Of the cost: while plain squares lead towards an optimum of Huber's loss, iterations end where
/// they gain less: outliers then do no harm, because the robust loss decides in the end.
inline constexpr double kApproachTolerance = 1e-2;
/// Of the bound of Huber's loss: its bound falls by this factor from the median residual; far from
/// the optimum the loss is linear in nearly all residuals, and Gauss-Newton steps are short.
inline constexpr double kApproachFactor = 4.0;
/// Of the cost: with Huber's loss Ceres ends here and Newton's method goes on, which unlike Ceres
/// counts no curvature where the loss is linear (convergence by 0.75 a step where half of the
/// residuals are).
inline constexpr double kRobustTolerance = 1e-4;
/// Of sigma: residuals with a smaller root mean square are free of noise and met to rounding.
inline constexpr double kExactFit = 1e-8;
/// Of the standard deviation of a parameter: a shorter Gauss-Newton step is left at convergence (ε
/// of minimise.h; Bates and Watts).
inline constexpr double kRelativeOffset = 1e-3;
/// Of the cost: iterations that each gain less may be the slow tail of a convergence by a constant
/// factor.
inline constexpr double kSlowGain = 1e-3;
/// Of the gain or step of the iteration before: an iteration that gains less converges faster than
/// by a constant factor worth an acceleration.
inline constexpr double kSlowRatio = 0.2;
/// Of the first cost: a plain fit that has more left after its first iterations has made no
/// progress, and growing windows are tried first.
inline constexpr double kNoProgress = 0.5;
/// Of the cost, at least 1 σ²: a profile that falls below the estimate's cost by more has found a
/// better minimum; values whose costs differ by less are level.
inline constexpr double kEqualProfile = 1e-4;
/// Of the deviation, or of the root of the rise: an end of a profile is no more exact than this.
inline constexpr double kProfileEnd = 1e-3;
/// Of 1 for a logarithm, else the scale of a parameter: the first step of the profile of a
/// parameter that has no standard deviation.
inline constexpr double kBlindStep = 1e-3;
/// Of the same: a profile is followed to a bound that is no farther off, whatever lies between.
inline constexpr double kNearBound = 10.0;
/// Of the same: a profile that is level so far has no end; the profile of an inertia that has
/// fallen to its bound 0 is level for 18.
inline constexpr double kLevelFor = 30.0;
/// Of the rise of a parabola at the ends of an interval: where the cost rises by more than this
/// factor more or less, the interval by derivatives is not to be trusted.
inline constexpr double kParabola = 1.5;
/// Of the way to such an end, its last part; and of what a parabola rises over that: a cost that
/// rises by less goes over into a plateau, and the interval may have no end.
inline constexpr double kLastOfWay = 0.05;
inline constexpr double kStillRises = 0.3;
/// Of 1 σ²: starts whose costs differ by less are equally good, and agree.
inline constexpr double kAgree = 1e-2;
/// Of the way to a bound, or of 1 for a logarithm or the scale of a parameter where there is none:
/// the shift of restitution and friction from which further starts begin.
inline constexpr double kShift = 0.5;
/// Of 1 for a logarithm, else the scale of a parameter: the same shift of all parameters where none
/// is a restitution or friction; a larger one leaves the neighbourhood of what was found.
inline constexpr double kShiftOfAll = 0.05;
/// Of the residuals' deviation, along a parameter: the distances from a minimum at a kink at which
/// the cost has to be higher.
inline constexpr double kKinkSteps[] = {1e-2, 1e-4};
/// Of the square of the residuals' deviation: a cost that is lower there by less is as high, as
/// that of the kink of a few parameters beside which derivatives lead nowhere.
inline constexpr double kKinkGain = 1e-4;
/// Of the length of q: a shorter final step is rounding.
inline constexpr double kPolishedStep = 1e-13;
/// Of the cost: costs that differ by less do not show which of two points is better.
inline constexpr double kEqualCost = 1e-9;
/// Of the deviation of a sensor's factor, or the spread itself: a fit with estimated noise or
/// spreads has converged where it changes them by less.
inline constexpr double kSettledChange = 1e-3;
/// Of the derivative of ln L by ln s: an intensity s that the likelihood pulls by less has no
/// effect on it where it has no curvature either.
inline constexpr double kUnseenScore = 1e-2;
/// Of the first intensity of a random force: where the search begins without forces.
inline constexpr double kNextToNone = 1e-4;
/// Of a parameter's deviation at the others held: the distance of the differences of the random
/// forces' determinant.
inline constexpr double kSlopeDistance = 0.1;
/// Of the curvature of the cost: a determinant that bends by more along a parameter is not smooth
/// there.
inline constexpr double kSlopeBend = 1.0;
/// Of one observation: the sigma of a sensor whose observations have a smaller redundancy ρ cannot
/// be estimated, because they leave no residuals.
inline constexpr double kLeastRedundancy = 0.5;
/// Of the time of all observations: the first window.
inline constexpr double kFirstPart = 1.0 / 32.0;
/// Of the window before: the length of the next window: the first of these at which the residuals
/// of what is new are small enough.
inline constexpr double kWindowGrowth[] = {2.0, 1.5, 1.2, 1.1, 1.05};
/// Of the residuals of the window before, at least sigma: larger residuals of the next window are
/// too far off, and it grows by less.
inline constexpr double kFarOff = 3.0;
/// Of 1 for a logarithm, else the scale of a parameter: the standard deviation of a parameter
/// around the estimate of the last window.
inline constexpr double kWindowPrior = 3.0;
/// Of the median sigma of the observations: the standard deviations of the jumps of multiple
/// shooting, stage by stage.
inline constexpr double kJumpSigmas[] = {1e3, 30.0, 1.0};
/// Of the median sigma of the observations: the standard deviation of the errors of joints at the
/// cuts of multiple shooting.
inline constexpr double kOnJoints = 0.01;
/// Of the degrees of freedom, with a little room for few of them: a parabola explains its samples
/// where their sum of squares is no larger.
inline constexpr double kExplained = 2.0;
/// Of the weight of the best observation: the weights of joints and contacts of an observed state,
/// stage by stage: from far outside of the joints the observations alone lead the way.
inline constexpr double kJointWeights[] = {0.0, 1.0, 1e2, 1e5};
/// Of the scale of an unknown: the standard deviation of a prior that an observed state stays where
/// it was: what is observed to 1e-3 of its scale is moved by 1e-14 of it, and what nothing
/// determines stays.
inline constexpr double kStatePrior = 1e4;
/// Of the scale of an unknown: the step of central differences, whose error is of its square.
inline constexpr double kStateDifference = 1e-5;
/// Of the length of a column: what elimination leaves of a column is rounding where it is shorter,
/// and the column is not determined.
inline constexpr double kUndeterminedColumn = 1e-12;
/// Of the median deviation of the value of a recording: the lower end of the range in which a
/// spread τ is sought.
inline constexpr double kLeastSpread = 1e-3;
/// Of the same, or the spread as it was if that is larger: the upper end of that range.
inline constexpr double kLargestSpread = 1e3;
/// Of the largest of the values of the recordings, the shared one and the parameter's typical
/// magnitude: the observations do not limit a larger spread. Two recordings limit it to some 30
/// times what is seen.
inline constexpr double kUnlimitedSpread = 1e3;
/// Of 1: the same of a spread of logarithms, −ln ε: the value of one recording would be rounding
/// beside that of another.
inline constexpr double kUnlimitedLogSpread = 36.0;
/// Of 1, for ln τ: smaller changes do not count, because a maximum is flat.
inline constexpr double kSettledLogarithm = 1e-6;
/// Of the upper end of the range: a spread as good as infinite: the recordings then say nothing
/// about each other.
inline constexpr double kInfiniteSpread = 1e6;
/// Of the diagonal of an information matrix, scaled to 1: what is added to it first, and more where
/// that is not enough, so that a direction without information has a finite deviation.
inline constexpr double kLeastInformation = 1e-12;
/// Of the largest eigenvalue of an information matrix with unit diagonal: directions with a smaller
/// one are not determined. The matrix is a product of Jacobians whose own bound is 1e-9: what is
/// below 1e-12 of it is rounding.
inline constexpr double kDesignRank = 1e-12;
/// Of the duration of a take: an observation that is later by less is at its end.
inline constexpr double kSameTakeTime = 1e-9;
/// 1 σ²: a cost that changes by less between points far out stays as it is; and what it may have
/// risen by for chains to come there.
inline constexpr double kFlatFarOut = 0.5;
inline constexpr double kReached = 30.0;
/// Of the length of what candidates for missing parts of a model explain: differences of the square
/// that are smaller do not tell them apart.
inline constexpr double kSameExplained = 1e-2;
/// Of the variance of a residual: the same where these differences are as small as the noise, three
/// standard deviations.
inline constexpr double kNoiseOfOne = 9.0;
/// Of the variance of a residual: what a column has to explain more to be worth its freedom; chance
/// explains 1.
inline constexpr double kWorthOfColumn = 4.0;

}  // namespace tangible
