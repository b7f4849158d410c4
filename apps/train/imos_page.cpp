// SPDX-License-Identifier: MIT
#include "apps/train/imos_page.h"

#include <algorithm>

#include "apps/train/training_curves.h"

namespace holdfast::apps {

using nlohmann::json;

std::string ImosTrainingPage(const std::vector<json>& lines, long iterations) {
  const double end = static_cast<double>(std::max(iterations, 1l));
  const auto rollout = [&](const char* at, const char* name, const char* colour) {
    return CurveOf(lines, "rollout", json::json_pointer(at), 100.0, name, colour);
  };
  const auto train = [&](const char* at, const char* name, const char* colour) {
    return CurveOf(lines, "train", json::json_pointer(at), 1.0, name, colour);
  };
  return PageOfFigures(
      "Training of an IMoS network",
      {Figure("Joints of free rollouts, cm from what happened (subjects not trained on)",
              {rollout("/validation/mpjpe_m", "mean", "#1f7a4d"),
               rollout("/train/mpjpe_m", "of those trained on", "#8a9099"),
               rollout("/validation/still_m", "standing still", "#c3c8ce")},
              end, false),
       Figure("Wrist that carries, cm",
              {rollout("/validation/wrists_m", "mean", "#b4521e"),
               rollout("/validation/last_wrist_m", "in the last key frame", "#d39a2d"),
               rollout("/train/wrists_m", "of those trained on", "#8a9099")},
              end, false),
       Figure("Object and root, cm",
              {rollout("/validation/object_m", "object", "#8a3ffc"),
               rollout("/validation/root_m", "root", "#0f62fe")},
              end, false),
       Figure("Losses of 6D poses in training",
              {train("/arms", "arms", "#b4521e"), train("/body", "body", "#0f62fe"),
               train("/velocity", "steps", "#1f7a4d")},
              end, true),
       Figure("Losses of positions in training, metres",
              {train("/joints", "joints", "#0f62fe"), train("/wrists", "wrists", "#b4521e"),
               train("/root", "root's steps", "#8a3ffc")},
              end, true),
       Figure("Divergence of latents, nats each, of all encoders",
              {train("/divergence", "divergence", "#8a3ffc")}, end, true),
       Figure("Critic: its doubts about whole motions, and the share that it judges rightly",
              {train("/doubt", "doubt", "#b4521e"), train("/critic", "judged rightly", "#0f62fe")},
              end, false),
       Figure("Learning rate", {train("/learning_rate", "rate", "#5b6470")}, end, true)});
}

}  // namespace holdfast::apps
