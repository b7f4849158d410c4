// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include <Eigen/Core>

namespace holdfast::imos {

// What IMoS (Ghosh et al. 2023) measures of a set of motions through a recognition network: each
// as the authors' code computes it, so that a number may stand beside the paper's, and as the
// field defines it. Features are columns (128 x N) of imos::Recognizer; labels are action ids.

/// "FID" of the authors' code: motion by motion against its own reference,
/// ||f - f'||^2 + (s - s')^2, s the standard deviation of a motion's 128 numbers; the mean over
/// motions. A distance of pairs, not of distributions. Throws Error for sets of unequal sizes.
double FrechetDistanceOfCode(const Eigen::MatrixXf& features, const Eigen::MatrixXf& reference);

/// Frechet distance of the Gaussians of two sets (Heusel et al. 2017), unequal sizes allowed:
/// ||m - m'||^2 + tr(C + C' - 2 (C^1/2 C' C^1/2)^1/2). Throws Error for sets of less than two.
/// Biased upwards for small sets: compare sets of one size only.
double FrechetDistance(const Eigen::MatrixXf& features, const Eigen::MatrixXf& reference);

/// Share of motions whose recognized label is the one asked for.
double RecognitionAccuracy(std::span<const int> recognized, std::span<const int> labels);

/// Diversity as the authors' code draws it: mean distance of 200 random pairs, a motion being
/// paired with itself by chance.
double DiversityOfCode(const Eigen::MatrixXf& features, std::uint64_t seed);
/// Mean distance of all pairs of two different motions: what random pairs (Guo et al. 2020)
/// estimate. Throws Error for less than two.
double Diversity(const Eigen::MatrixXf& features);

/// Multimodality as the authors' code draws it: random pairs of one *recognized* label, up to 20
/// per label, at most 10,001 draws, a motion being paired with itself by chance; the sum over
/// (20 * num_labels), so that labels that never occur count as zero.
double MultimodalityOfCode(const Eigen::MatrixXf& features, std::span<const int> recognized,
                           int num_labels, std::uint64_t seed);
/// Mean distance of two different motions of one label *asked for*, all pairs, averaged over the
/// labels that have two motions or more; empty when none has.
std::optional<double> Multimodality(const Eigen::MatrixXf& features, std::span<const int> labels);

/// A number that was measured several times.
struct RepeatedValue {
  double mean = 0.0;
  double interval = 0.0;  ///< half width of 95 %: 1.96 s / sqrt(n); 0 for one repeat
  int repeats = 0;
};
RepeatedValue OverRepeats(std::span<const double> values);

}  // namespace holdfast::imos
