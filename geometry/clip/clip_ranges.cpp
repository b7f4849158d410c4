// SPDX-License-Identifier: MIT
#include <optional>
#include <string_view>

#include <fmt/format.h>

#include "geometry/clip/clip.h"
#include "geometry/error.h"
#include "geometry/value_ranges.h"

namespace holdfast {

void RequireInRange(const Clip& clip, std::string_view where) {
  RequireFrameRate(clip.frame_rate, where);
  RequireWithin(clip.trans, kMostMetres, where, "trans", "frame", kMetresRemedy);
  for (std::size_t t = 0; t < clip.pose.size(); ++t) {
    for (Eigen::Index j = 0; j < clip.pose[t].cols(); ++j) {
      for (Eigen::Index k = 0; k < 3; ++k) {
        const double angle = clip.pose[t](k, j);
        if (IsWithin(angle, kMostRadians)) continue;
        throw Error(where,
                    fmt::format("turns its {} by {:g} in frame {}", kJointNames[j], angle, t),
                    kRadiansRemedy);
      }
    }
  }
  RequireWithin(clip.betas.transpose(), kMostBeta, where, "betas", "coefficient",
                "Shape coefficients are standard deviations, within 1,000");
  RequireWithin(clip.v_template, kMostMetres, where, "v_template", "vertex", kMetresRemedy);
  const auto require_track = [&](const std::optional<ObjectTrack>& track, std::string_view name) {
    if (!track) return;
    RequireWithin(track->trans, kMostMetres, where, fmt::format("{}_trans", name), "frame",
                  kMetresRemedy);
    RequireWithin(track->orient, kMostRadians, where, fmt::format("{}_orient", name), "frame",
                  kRadiansRemedy);
  };
  require_track(clip.object, "object");
  require_track(clip.table, "table");
}

}  // namespace holdfast
