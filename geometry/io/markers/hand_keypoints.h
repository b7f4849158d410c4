// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

namespace holdfast {

/// Keypoints of a hand: the wrist, then of thumb, index, middle, ring and little finger three
/// joints and the tip each, from the palm outwards.
inline constexpr int kNumKeypoints = 21;

/// How a source numbers them.
struct KeypointOrder {
  std::string_view name;
  std::string_view used_by;
  int count;                              ///< points per hand
  std::array<int, kNumKeypoints> source;  ///< of each keypoint
};
std::span<const KeypointOrder> KeypointOrders();

/// Keypoints of one hand over time, in one of the orders, as read.
struct KeypointTable {
  int points = 0;             ///< per frame
  Eigen::MatrixXd positions;  ///< (3 points x T), in the file's unit; NaN where not seen
  /// (3 * 21 x T), in the order of kNumKeypoints. `order.count` must be `points`.
  Eigen::MatrixXd In(const KeypointOrder& order) const;
};

/// Reads a table for each hand in the file: an array (T, N, 3), (T, 3N), (N, 3), or (T, H, N, 3)
/// and (H, T, N, 3) of H = 2 hands, with N = 21, 25 or 26; by itself (.npy, .npz with one such
/// array, .pkl, .pt, .json) or under a common name (keypoints, landmarks, joints ...); in JSON also
/// a list of frames, each a list of points or of {"x", "y", "z"}, null or empty without a hand.
/// Throws Error for anything else, naming the arrays that exist.
std::vector<KeypointTable> ReadHandKeypoints(const std::filesystem::path& path);

}  // namespace holdfast
