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

// A list of {"x", "y", "z"}, or of lists of them; as numbers with a shape.
bool ReadPoints(const DataValue& value, int depth, std::vector<std::size_t>& shape,
                std::vector<double>& numbers) {
  constexpr int kDepth = 3;
  if (value.Kind() != DataKind::kList || value.Size() == 0 || depth > kDepth) return false;
  if (shape.size() <= static_cast<std::size_t>(depth)) shape.push_back(value.Size());
  if (shape[static_cast<std::size_t>(depth)] != value.Size()) return false;
  for (std::size_t i = 0; i < value.Size(); ++i) {
    const DataValue item = value[i];
    if (item.Kind() != DataKind::kDict) {
      if (!ReadPoints(item, depth + 1, shape, numbers)) return false;
      continue;
    }
    for (const char* axis : {"x", "y", "z"}) {
      const auto number = item.Find(axis);
      if (!number || !number->HoldsNumbers()) return false;
      numbers.push_back(number->Number());
    }
  }
  return true;
}

std::optional<std::vector<KeypointTable>> ReadTables(const DataValue& value) {
  if (value.HoldsNumbers()) {
    const NpyMember member = value.Array();
    const std::optional<Layout> layout = LayoutOf(member.array.shape);
    if (!layout) return std::nullopt;
    return TablesOf(member.AsDoubles(), *layout, member.where);
  }
  std::vector<std::size_t> shape;
  std::vector<double> numbers;
  if (!ReadPoints(value, 0, shape, numbers)) return std::nullopt;
  shape.push_back(3);
  const std::optional<Layout> layout = LayoutOf(shape);
  if (!layout) return std::nullopt;
  return TablesOf(numbers, *layout, value.Where());
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
