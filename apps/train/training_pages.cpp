// SPDX-License-Identifier: MIT
#include <algorithm>

#include "apps/train/train_command.h"
#include "apps/train/training_curves.h"

namespace holdfast::apps {
namespace {

using nlohmann::json;

constexpr const char *kBlue = "#0f62fe", *kBrown = "#b4521e", *kGreen = "#1f7a4d",
                     *kViolet = "#8a3ffc", *kOchre = "#d39a2d", *kGray = "#8a9099";

// Where lines of training.jsonl have a curve's numbers, and how it is drawn.
struct CurveAt {
  const char *kind, *at;
  double scale;
  const char *name, *color;
};

struct FigureOf {
  const char* title;
  bool logarithmic;
  std::vector<CurveAt> curves;
};

std::string Page(const char* title, const std::vector<FigureOf>& figures,
                 const std::vector<json>& lines, long iterations) {
  std::vector<std::string> drawn;
  for (const FigureOf& figure : figures) {
    std::vector<Curve> curves;
    for (const CurveAt& c : figure.curves) {
      curves.push_back(CurveOf(lines, c.kind, json::json_pointer(c.at), c.scale, c.name, c.color));
    }
    drawn.push_back(Figure(figure.title, curves, static_cast<double>(std::max(iterations, 1l)),
                           figure.logarithmic));
  }
  return PageOfFigures(title, drawn);
}

}  // namespace

std::string ImosTrainingPage(const std::vector<json>& lines, long iterations) {
  return Page(
      "Training of an IMoS network",
      {{"Joints of free rollouts, cm from what happened (subjects not trained on)",
        false,
        {{"rollout", "/validation/mpjpe_m", 100.0, "mean", kGreen},
         {"rollout", "/train/mpjpe_m", 100.0, "of those trained on", kGray},
         {"rollout", "/validation/still_m", 100.0, "standing still", "#c3c8ce"}}},
       {"Wrist that carries, cm",
        false,
        {{"rollout", "/validation/wrists_m", 100.0, "mean", kBrown},
         {"rollout", "/validation/last_wrist_m", 100.0, "in the last key frame", kOchre},
         {"rollout", "/train/wrists_m", 100.0, "of those trained on", kGray}}},
       {"Object and root, cm",
        false,
        {{"rollout", "/validation/object_m", 100.0, "object", kViolet},
         {"rollout", "/validation/root_m", 100.0, "root", kBlue}}},
       {"Losses of 6D poses in training",
        true,
        {{"train", "/arms", 1.0, "arms", kBrown},
         {"train", "/body", 1.0, "body", kBlue},
         {"train", "/velocity", 1.0, "steps", kGreen}}},
       {"Losses of positions in training, meters",
        true,
        {{"train", "/joints", 1.0, "joints", kBlue},
         {"train", "/wrists", 1.0, "wrists", kBrown},
         {"train", "/root", 1.0, "root's steps", kViolet}}},
       {"Divergence of latents, nats each, of all encoders",
        true,
        {{"train", "/divergence", 1.0, "divergence", kViolet}}},
       {"Critic: adversarial loss of whole motions, and the share that it classifies correctly",
        false,
        {{"train", "/doubt", 1.0, "adversarial loss", kBrown},
         {"train", "/critic", 1.0, "accuracy", kBlue}}},
       {"Learning rate", true, {{"train", "/learning_rate", 1.0, "rate", "#5b6470"}}}},
      lines, iterations);
}

std::string WandrTrainingPage(const std::vector<json>& lines, long iterations) {
  return Page(
      "Training of a WANDR network",
      {{"Goals reached, % (within 10 cm, starts not trained on)",
        false,
        {{"reach", "/success", 100.0, "reached", kGreen}}},
       {"Distance left, cm",
        false,
        {{"reach", "/distance_m", 100.0, "mean", kBrown},
         {"reach", "/distance_median_m", 100.0, "median", kOchre}}},
       {"Frames with a skating foot, and airborne, %",
        false,
        {{"reach", "/skating", 100.0, "skating", kViolet},
         {"reach", "/airborne", 100.0, "airborne", kBlue}}},
       {"Losses of deltas in training",
        true,
        {{"train", "/translation", 1.0, "translation", kBlue},
         {"train", "/orientation", 1.0, "orientation", kBrown},
         {"train", "/pose", 1.0, "pose", kGreen}}},
       {"The same on clips not trained on",
        true,
        {{"reach", "/held_out/translation", 1.0, "translation", kBlue},
         {"reach", "/held_out/orientation", 1.0, "orientation", kBrown},
         {"reach", "/held_out/pose", 1.0, "pose", kGreen}}},
       {"Divergence of latents, nats each; joints' loss",
        true,
        {{"train", "/kl", 1.0, "divergence", kViolet},
         {"train", "/joints", 1.0, "joints", kOchre}}},
       {"Whole motions to goals: their loss, and how far they stray",
        true,
        {{"free", "/goal", 1.0, "goal", kBrown}, {"free", "/pose", 1.0, "straying (pose)", kBlue}}},
       {"The critic on them: adversarial loss and accuracy",
        false,
        {{"free", "/doubt", 1.0, "adversarial loss", kViolet},
         {"free", "/critic", 1.0, "accuracy", kGreen}}}},
      lines, iterations);
}

}  // namespace holdfast::apps
