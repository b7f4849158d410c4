// SPDX-License-Identifier: MIT
#include "geometry/io/markers/hand_keypoints.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/io/container/text_scanner.h"
#include "geometry/io/pickle/data_file.h"

namespace holdfast {
namespace {

constexpr std::array<KeypointOrder, 4> kOrders = {{
    {"mediapipe",
     "MediaPipe, OpenPose, Rokoko, FrankMocap, HaMeR",
     21,
     {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20}},
    // Joints as in MANO (index, middle, little, ring, thumb), then the tips, thumb first.
    {"mano", "MANO, HO-3D", 21, {0, 13, 14, 15, 16, 1,  2, 3, 17, 4, 5,
                                 6, 18, 10, 11, 12, 19, 7, 8, 9,  20}},
    // The metacarpal base of each finger is left out, but for the thumb.
    {"webxr", "WebXR, MANUS, Leap", 25, {0,  1,  2,  3,  4,  6,  7,  8,  9,  11, 12,
                                         13, 14, 16, 17, 18, 19, 21, 22, 23, 24}},
    {"openxr", "OpenXR (palm, wrist ...)", 26, {1,  2,  3,  4,  5,  7,  8,  9,  10, 12, 13,
                                                14, 15, 17, 18, 19, 20, 22, 23, 24, 25}},
}};

constexpr std::array<std::string_view, 12> kNames = {
    "keypoints", "landmarks", "world_landmarks", "hand_keypoints",    "keypoints_3d", "joints",
    "joints_3d", "kpts_3d",   "handJoints3D",    "pred_keypoints_3d", "positions",    "xyz"};
constexpr double kMaxFrames = 5e6;

bool IsCount(std::size_t points) {
  return std::ranges::any_of(kOrders, [&](const KeypointOrder& order) {
    return static_cast<std::size_t>(order.count) == points;
  });
}

struct Layout {
  std::size_t hands = 1, frames = 1, points = 0;
  bool hands_first = false;
};

std::optional<Layout> LayoutOf(const std::vector<std::size_t>& shape) {
  const std::size_t size = shape.size();
  if (size == 2 && shape[1] % 3 == 0 && IsCount(shape[1] / 3)) {
    return Layout{1, shape[0], shape[1] / 3};
  }
  if (size < 2 || shape[size - 1] != 3 || !IsCount(shape[size - 2])) return std::nullopt;
  const std::size_t points = shape[size - 2];
  if (size == 2) return Layout{1, 1, points};
  if (size == 3) return Layout{1, shape[0], points};
  if (size == 4 && shape[1] <= 2) return Layout{shape[1], shape[0], points};
  if (size == 4 && shape[0] <= 2) return Layout{shape[0], shape[1], points, true};
  return std::nullopt;
}

std::vector<KeypointTable> TablesOf(const std::vector<double>& numbers, const Layout& layout,
                                    const std::string& where) {
  if (layout.frames == 0) throw Error(where, "has no frames", "Give at least one frame");
  if (static_cast<double>(layout.frames) > kMaxFrames) {
    throw Error(where, fmt::format("has {} frames", layout.frames), "Cut it into clips");
  }
  const auto rows = static_cast<Eigen::Index>(3 * layout.points);
  const auto frames = static_cast<Eigen::Index>(layout.frames);
  const auto hands = static_cast<Eigen::Index>(layout.hands);
  const Eigen::Map<const Eigen::MatrixXd> all(numbers.data(), rows, frames * hands);
  std::vector<KeypointTable> tables;
  for (Eigen::Index h = 0; h < hands; ++h) {
    KeypointTable& table = tables.emplace_back();
    table.points = static_cast<int>(layout.points);
    table.positions.resize(rows, frames);
    for (Eigen::Index t = 0; t < frames; ++t) {
      table.positions.col(t) = all.col(layout.hands_first ? h * frames + t : t * hands + h);
      // Not seen: a number that is not finite, or a whole hand of zeros.
      const bool gap = table.positions.col(t).isZero(0.0);
      for (Eigen::Index i = 0; i < rows; i += 3) {
        if (!gap && table.positions.col(t).segment<3>(i).allFinite()) continue;
        table.positions.col(t).segment<3>(i).setConstant(std::numeric_limits<double>::quiet_NaN());
      }
    }
  }
  return tables;
}

// The numbers of one frame: points as {"x", "y", "z"} or as three numbers. nullopt for other
// values.
std::optional<std::vector<double>> PointsOf(const DataValue& frame) {
  if (frame.HoldsNumbers()) {
    const NpyMember member = frame.Array();
    const std::vector<std::size_t>& shape = member.array.shape;
    if (shape.size() != 2 || shape[1] != 3) return std::nullopt;
    return member.AsDoubles();
  }
  std::vector<double> numbers;
  for (std::size_t i = 0; i < frame.Size(); ++i) {
    const DataValue point = frame[i];
    if (point.Kind() != DataKind::kDict) return std::nullopt;
    for (const char* axis : {"x", "y", "z"}) {
      const auto number = point.Find(axis);
      if (!number || !number->HoldsNumbers()) return std::nullopt;
      numbers.push_back(number->Number());
    }
  }
  return numbers;
}

// A list of frames, of which those without a hand are null or empty; or one frame.
std::optional<std::vector<KeypointTable>> ReadList(const DataValue& value) {
  if (value.Kind() != DataKind::kList || value.Size() == 0) return std::nullopt;
  const bool one = value[std::size_t{0}].Kind() == DataKind::kDict;
  std::vector<std::vector<double>> frames;
  for (std::size_t t = 0; t < (one ? 1 : value.Size()); ++t) {
    const DataValue frame = one ? value : value[t];
    const bool empty =
        frame.Kind() == DataKind::kNone || (frame.Kind() == DataKind::kList && frame.Size() == 0);
    std::optional<std::vector<double>> points(std::in_place);
    if (!empty) points = PointsOf(frame);
    if (!points) return std::nullopt;
    frames.push_back(*std::move(points));
  }
  std::size_t size = 0;
  for (const std::vector<double>& frame : frames) size = std::max(size, frame.size());
  std::vector<double> numbers;
  for (const std::vector<double>& frame : frames) {
    if (!frame.empty() && frame.size() != size) return std::nullopt;
    if (frame.empty()) {
      numbers.insert(numbers.end(), size, std::numeric_limits<double>::quiet_NaN());
    }
    numbers.insert(numbers.end(), frame.begin(), frame.end());
  }
  if (size % 3 != 0 || !IsCount(size / 3)) return std::nullopt;
  return TablesOf(numbers, {1, frames.size(), size / 3}, value.Where());
}

std::optional<std::vector<KeypointTable>> ReadTables(const DataValue& value) {
  if (value.HoldsNumbers()) {
    const NpyMember member = value.Array();
    const std::optional<Layout> layout = LayoutOf(member.array.shape);
    if (!layout) return std::nullopt;
    return TablesOf(member.AsDoubles(), *layout, member.where);
  }
  return ReadList(value);
}

}  // namespace

std::span<const KeypointOrder> KeypointOrders() { return kOrders; }

Eigen::MatrixXd KeypointTable::In(const KeypointOrder& order) const {
  Eigen::MatrixXd keypoints(3 * kNumKeypoints, positions.cols());
  for (int k = 0; k < kNumKeypoints; ++k) {
    keypoints.middleRows<3>(3 * k) =
        positions.middleRows<3>(3 * order.source[static_cast<std::size_t>(k)]);
  }
  return keypoints;
}

std::vector<KeypointTable> ReadHandKeypoints(const std::filesystem::path& path) {
  const DataFile file(path);
  std::vector<std::string> names;
  const bool named = file.Format() == DataFormat::kNpz || file.Root().Kind() == DataKind::kDict;
  if (!named) {
    if (auto tables = ReadTables(file.Root())) return *std::move(tables);
  } else {
    names = file.Names();
    std::vector<std::string> candidates;
    for (const std::string_view name : kNames) {
      if (file.Has(name)) candidates.emplace_back(name);
    }
    if (candidates.empty() && names.size() == 1) candidates = names;
    for (const std::string& name : candidates) {
      if (auto tables = ReadTables(file[name])) return *std::move(tables);
    }
  }
  constexpr std::size_t kMaxNamed = 12;
  throw Error(path.string(),
              fmt::format("holds no keypoints of a hand{}",
                          names.empty() ? "" : ": it has " + SomeNames(names, kMaxNamed)),
              "Give an array (frames, points, 3) of 21, 25 or 26 points, by itself or as "
              "'keypoints', or markers (C3D, TRC, CSV, TSV)");
}

}  // namespace holdfast
