// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "generator/scripted/handover_motion.h"
#include "geometry/body/body_model.h"

namespace holdfast {

/// A study of how well handovers are found in clips whose truth is known.
struct HandoverStudyOptions {
  int count = 40;  ///< clips, with seeds `seed` .. `seed` + count - 1
  std::uint64_t seed = 1;
  ClipNoise noise = {0.005, 0.0523599, 0.0174533};  ///< 5 mm and 3 deg, 1 deg of every joint
  double tolerance_s = 2.0 / 30.0;  ///< a switch is found within this: two frames at 30 Hz
  double frame_rate = 30.0;         ///< Hz
  int threads = 1;                  ///< the result does not depend on it
};

/// One clip of the study.
struct HandoverStudyClip {
  std::uint64_t seed = 0;
  std::string object;
  std::vector<int> truth;           ///< frames where it switches
  std::vector<int> with_object;     ///< found by FindHolds from the noisy trajectory
  std::vector<int> without_object;  ///< found by FindHandovers from the body alone
  double hands_right = 0.0;  ///< share of frames for which FindHolds names the hands that hold
  bool found_with_object = false;  ///< every switch within the tolerance, and no others
  bool found_without_object = false;
};

struct HandoverStudy {
  std::vector<HandoverStudyClip> clips;
  int found_with_object = 0;       ///< clips
  int found_without_object = 0;    ///< clips
  double mean_error_frames = 0.0;  ///< of the switches that FindHolds found, absolute
  double hands_right = 0.0;        ///< mean over clips
};

/// Makes synthetic handovers of embedded objects (MakeHandoverMotion on PalmGrasps), disturbs them,
/// and looks for their switches with and without the object's trajectory. Deterministic.
HandoverStudy RunHandoverStudy(const std::shared_ptr<const BodyModel>& body,
                               const HandoverStudyOptions& options = {});

}  // namespace holdfast
