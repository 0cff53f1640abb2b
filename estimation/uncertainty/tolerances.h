// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The tolerances of the uncertainty of a fit. Each comment names the quantity of which the
// tolerance is a fraction or multiple, then the reason. The README has the table.

namespace tangible {

/// Of the largest singular value, or diagonal entry, of a Jacobian with unit columns: directions
/// with a smaller one are not determined, because derivatives are computed to about 1e-12.
inline constexpr double kJacobianRank = 1e-9;
/// Of the same: the same for finite differences, which carry an error of about 1e-9.
inline constexpr double kDifferencesRank = 1e-6;
/// Of the largest diagonal entry of A − A_g with unit diagonal: without recording g, parameters are
/// not determined where a diagonal entry is smaller; a lower rank_tolerance has no effect,
/// because A is a product.
inline constexpr double kJackknifeRank = 1e-12;
/// Of sigma: a parameter whose change by its own magnitude moves the residuals by less, to first
/// order, has no effect at the estimate: its derivative is rounding, as where the cost is flat.
inline constexpr double kRoundingColumn = 1e-9;
/// Of the largest share of a direction: a parameter with a smaller share does not belong to the
/// direction, because smaller shares are rounding and errors of derivatives.
inline constexpr double kSmallShare = 1e-4;
/// Of the largest weight of a combination: smaller weights are rounding or errors of derivatives.
inline constexpr double kSmallWeight = 1e-6;
/// Of the column of a held parameter: a held parameter cannot be distinguished from the free
/// parameters if these reproduce all but a smaller part of its column.
inline constexpr double kSeparable = 1e-5;
/// Of a held value, at least its typical magnitude: a larger change to first order is an
/// extrapolation of a value that has next to no effect, and no cause of what the model misses.
inline constexpr double kLargestChange = 1e3;
/// Of the standard deviation: the quantile of 0.975 of the normal distribution: half of a 95 %
/// interval.
inline constexpr double kNormalQuantile = 1.959963984540054;
/// Of the median absolute value: the standard deviation of a normal distribution.
inline constexpr double kDeviationByMedian = 1.4826;
/// Of sqrt(2 / (N − P)), the standard deviation of the reduced chi-square: a reduced chi-square
/// that is above 1 by more says that the model or sigma is wrong.
inline constexpr double kChiSquareDeviations = 5.0;
/// Of 1.17 / sqrt(N), the standard deviation of a median's scale: with Huber's loss residuals are
/// judged by their median, because outliers are what the loss is there for.
inline constexpr double kMedianDeviations = 5.0;
inline constexpr double kDeviationOfMedian = 1.17;
/// Of the prior's sigma: an estimate that is farther from its prior's centre contradicts it.
inline constexpr double kContradictsPrior = 4.0;
/// Of 1, a probability: residuals count as correlated where white residuals have such a correlation
/// with a smaller probability.
inline constexpr double kWhitenessProbability = 1e-4;
/// Of 1, a probability, over the number of parameters: a parameter counts as drifting where
/// recordings that can be exchanged have such sums with a smaller probability.
inline constexpr double kDriftProbability = 1e-3;
/// Of perfect correlation from one sample to the next: below it intervals change by less than 10 %,
/// so that the correlation does not matter.
inline constexpr double kWhitenessCorrelation = 0.1;
/// Of 1, a probability: smaller probabilities are printed as this bound.
inline constexpr double kLeastProbability = 1e-12;
/// Of the duration of a recording: wider kernels leave fewer than 4.5 degrees of freedom.
inline constexpr double kLargestBandwidth = 1.0 / 3.0;
/// Of perfect correlation from one sample to the next: an autoregression that is nearer to 1 asks
/// for a kernel beyond kLargestBandwidth anyway.
inline constexpr double kLargestAutoregression = 0.97;
/// Of the cube root of α N: the bandwidth of Bartlett's kernel, in samples (Andrews 1991, equation
/// 6.2).
inline constexpr double kAndrewsFactor = 1.1447;
/// Of 1, the unit of −ln π: a state of a trajectory whose energy is above that of its first one by
/// more is a divergence; errors of a stable step are of the size of 1.
inline constexpr double kDivergent = 1000.0;
/// Of 1: chains with a larger split R-hat have not mixed (Vehtari et al. 2021, section 2).
inline constexpr double kMixed = 1.01;
/// Draws: a quantile from fewer effective ones is not to be trusted (the same, for four chains).
inline constexpr double kLeastEffective = 400.0;
/// Of 1: replicas that exchange their points in a smaller share of the cases do not pass on what
/// the hot ones find.
inline constexpr double kLeastExchanged = 0.05;

}  // namespace tangible
