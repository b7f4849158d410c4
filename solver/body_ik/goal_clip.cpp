// SPDX-License-Identifier: MIT
#include "solver/body_ik/goal_clip.h"

#include <cstdint>
#include <vector>

#include "geometry/clip/clip_arrays.h"
#include "geometry/io/container/json_text.h"
#include "geometry/io/container/npz.h"

namespace holdfast {

void WriteGoalClip(Clip clip, std::span<const ReachLabel> labels, const nlohmann::json& provenance,
                   const std::filesystem::path& path) {
  RoundToFloat(clip);
  NpzWriter writer;
  AddArrays(clip, writer);
  std::vector<double> goals;
  std::vector<std::int64_t> frames;
  std::vector<std::uint8_t> wrists;
  for (const ReachLabel& label : labels) {
    goals.insert(goals.end(), label.goal.begin(), label.goal.end());
    frames.push_back(label.frame);
    wrists.push_back(label.wrist == Side::kRight ? kHoldsRight : kHoldsLeft);
  }
  writer.AddFloat64("goal", {labels.size(), 3}, goals);
  writer.AddInt64("goal_frame", {labels.size()}, frames);
  writer.AddUint8("goal_wrist", {labels.size()}, wrists);
  writer.AddText("provenance", JsonText(provenance));
  writer.Write(path);
}

}  // namespace holdfast
