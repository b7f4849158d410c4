// SPDX-License-Identifier: MIT
#include "apps/train/training_page.h"

#include <algorithm>

#include "apps/train/training_curves.h"

namespace holdfast::apps {

using nlohmann::json;

std::string TrainingPage(const std::vector<json>& lines, long iterations) {
  const double end = static_cast<double>(std::max(iterations, 1l));
  const auto reach = [&](const char* at, double scale, const char* name, const char* colour) {
    return CurveOf(lines, "reach", json::json_pointer(at), scale, name, colour);
  };
  const auto train = [&](const char* at, const char* name, const char* colour) {
    return CurveOf(lines, "train", json::json_pointer(at), 1.0, name, colour);
  };
  std::vector<std::string> figures;
  figures.push_back(Figure("Goals reached, % (within 10 cm, starts not trained on)",
                           {reach("/success", 100.0, "reached", "#1f7a4d")}, end, false));
  figures.push_back(Figure("Distance left, cm",
                           {reach("/distance_m", 100.0, "mean", "#b4521e"),
                            reach("/distance_median_m", 100.0, "median", "#d39a2d")},
                           end, false));
  figures.push_back(Figure("Frames with a skating foot, and airborne, %",
                           {reach("/skating", 100.0, "skating", "#8a3ffc"),
                            reach("/airborne", 100.0, "airborne", "#0f62fe")},
                           end, false));
  figures.push_back(
      Figure("Losses of deltas in training",
             {train("/translation", "translation", "#0f62fe"),
              train("/orientation", "orientation", "#b4521e"), train("/pose", "pose", "#1f7a4d")},
             end, true));
  figures.push_back(Figure("The same on clips not trained on",
                           {reach("/held_out/translation", 1.0, "translation", "#0f62fe"),
                            reach("/held_out/orientation", 1.0, "orientation", "#b4521e"),
                            reach("/held_out/pose", 1.0, "pose", "#1f7a4d")},
                           end, true));
  figures.push_back(Figure(
      "Divergence of latents, nats each; joints' loss",
      {train("/kl", "divergence", "#8a3ffc"), train("/joints", "joints", "#d39a2d")}, end, true));
  const auto free = [&](const char* at, const char* name, const char* colour) {
    return CurveOf(lines, "free", json::json_pointer(at), 1.0, name, colour);
  };
  figures.push_back(Figure(
      "Whole motions to goals: their loss, and how far they stray",
      {free("/goal", "goal", "#b4521e"), free("/pose", "straying (pose)", "#0f62fe")}, end, true));
  figures.push_back(Figure(
      "What the critic makes of them: doubt, and how often it is right",
      {free("/doubt", "doubt", "#8a3ffc"), free("/critic", "right", "#1f7a4d")}, end, false));
  return PageOfFigures("Training of a WANDR network", figures);
}

}  // namespace holdfast::apps
