// SPDX-License-Identifier: MIT
#include "geometry/value_ranges.h"

#include <algorithm>
#include <string>

#include <fmt/format.h>

#include "geometry/error.h"

namespace holdfast {
namespace {

constexpr std::string_view kMetres = "Positions are metres, within 100,000: check the units";
constexpr std::string_view kRadians = "Angles are radians, within 1,000: check the units";

bool Within(double value, double most) { return value >= -most && value <= most; }

template <typename T>
std::optional<std::size_t> FindBeyond(std::span<const T> values, double most) {
  constexpr std::size_t kBlock = 4096;
  for (std::size_t begin = 0; begin < values.size(); begin += kBlock) {
    const auto block = values.subspan(begin, std::min(kBlock, values.size() - begin));
    const Eigen::Map<const Eigen::Array<T, Eigen::Dynamic, 1>> x(
        block.data(), static_cast<Eigen::Index>(block.size()));
    if (Within(x.abs().template maxCoeff<Eigen::PropagateNaN>(), most)) continue;
    const auto bad = std::ranges::find_if(block, [&](T value) { return !Within(value, most); });
    return begin + static_cast<std::size_t>(bad - block.begin());
  }
  return std::nullopt;
}

// `columns` of a matrix are frames (or what `column_is` says).
template <typename Matrix>
void RequireWithin(const Matrix& values, double most, std::string_view where,
                   std::string_view field, std::string_view column_is, std::string_view remedy) {
  for (Eigen::Index c = 0; c < values.cols(); ++c) {
    for (Eigen::Index r = 0; r < values.rows(); ++r) {
      if (Within(values(r, c), most)) continue;
      throw Error(fmt::format("{}[{}]", where, field),
                  fmt::format("holds {:g} in {} {}", values(r, c), column_is, c), remedy);
    }
  }
}

void RequireFrameRate(double rate, std::string_view where) {
  if (rate >= kLowestFrameRate && rate <= kHighestFrameRate) return;
  throw Error(where, fmt::format("has {:g} frames per second", rate),
              "1 to 10,000 are taken: check the rate (import --source-fps says another)");
}

}  // namespace

void RequireInRange(const Clip& clip, std::string_view where) {
  RequireFrameRate(clip.frame_rate, where);
  RequireWithin(clip.trans, kMostMetres, where, "trans", "frame", kMetres);
  for (std::size_t t = 0; t < clip.pose.size(); ++t) {
    for (Eigen::Index j = 0; j < clip.pose[t].cols(); ++j) {
      for (Eigen::Index k = 0; k < 3; ++k) {
        const double angle = clip.pose[t](k, j);
        if (Within(angle, kMostRadians)) continue;
        throw Error(where,
                    fmt::format("turns its {} by {:g} in frame {}", kJointNames[j], angle, t),
                    kRadians);
      }
    }
  }
  RequireWithin(clip.betas.transpose(), kMostBeta, where, "betas", "coefficient",
                "Shape coefficients are standard deviations, within 1,000");
  RequireWithin(clip.v_template, kMostMetres, where, "v_template", "vertex", kMetres);
  const auto require_track = [&](const std::optional<ObjectTrack>& track, std::string_view name) {
    if (!track) return;
    RequireWithin(track->trans, kMostMetres, where, fmt::format("{}_trans", name), "frame",
                  kMetres);
    RequireWithin(track->orient, kMostRadians, where, fmt::format("{}_orient", name), "frame",
                  kRadians);
  };
  require_track(clip.object, "object");
  require_track(clip.table, "table");
}

void RequireInRange(const SourceMotion& motion, std::string_view where) {
  RequireFrameRate(motion.frame_rate, where);
  const std::string remedy = fmt::format("{} (import --metres-per-unit says another)", kMetres);
  const auto require = [&](const auto& positions, std::string_view field, std::string_view column) {
    RequireWithin(positions, kMostMetres, where, field, column, remedy);
  };
  require(motion.rest_offsets, "offsets", "joint");
  for (std::size_t t = 0; t < motion.positions.size(); ++t) {
    require(motion.positions[t], fmt::format("frame {}", t), "joint");
  }
  for (std::size_t i = 0; i < motion.rotations.size(); ++i) {
    if (motion.rotations[i].coeffs().allFinite()) continue;
    throw Error(where,
                fmt::format("a rotation of frame {} is no number", i / motion.joint_names.size()),
                "Cut such frames out, or export it again");
  }
  if (!motion.prop) return;
  require(motion.prop->positions, motion.prop->name, "frame");
  RequireInRange(motion.prop->mesh, where);
}

void RequireInRange(const TriangleMesh& mesh, std::string_view where) {
  for (Eigen::Index v = 0; v < mesh.NumVertices(); ++v) {
    for (Eigen::Index k = 0; k < 3; ++k) {
      if (Within(mesh.vertices(k, v), kMostMetres)) continue;
      throw Error(where, fmt::format("vertex {} has the coordinate {:g}", v, mesh.vertices(k, v)),
                  "Coordinates are taken within 100,000: remove the vertex, or scale the mesh");
    }
  }
}

std::optional<std::size_t> FirstBeyond(std::span<const float> values, double most) {
  return FindBeyond(values, most);
}
std::optional<std::size_t> FirstBeyond(std::span<const double> values, double most) {
  return FindBeyond(values, most);
}

}  // namespace holdfast
