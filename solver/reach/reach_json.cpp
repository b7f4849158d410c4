// SPDX-License-Identifier: MIT
#include "solver/reach/reach_json.h"

namespace holdfast {

nlohmann::json MotionJson(const ReachMotion& motion) {
  const ReachQuality& quality = motion.quality;
  return {{"sample", motion.index},
          {"frames", motion.sample.track.states.cols()},
          {"goals_reached", motion.sample.NumReached()},
          {"closest_sum_m", quality.closest_sum_m},
          {"foot_skating_ratio", quality.skating},
          {"foot_skating_joints_ratio", quality.joint_skating},
          {"airborne_ratio", quality.airborne},
          {"peak_pelvis_m_s", quality.peak_pelvis_m_s},
          {"diverged", motion.sample.diverged}};
}

}  // namespace holdfast
