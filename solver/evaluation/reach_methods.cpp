// SPDX-License-Identifier: MIT
#include "solver/evaluation/reach_methods.h"

#include <algorithm>

#include <fmt/format.h>

#include "generator/wandr/motion_states.h"
#include "generator/wandr/walk_pace.h"
#include "geometry/io/container/json_file.h"
#include "geometry/parallel.h"
#include "solver/body_ik/reach_refit.h"
#include "solver/latent/latent_optimizer.h"
#include "solver/latent/vae_opt.h"

namespace holdfast {
namespace {

// Each motion sampled once in closed loop, as `holdfast reach --samples 1`, due by the protocol.
ReachMethod Intention(const ReachGenerator& with, const wandr::ReachProtocol& protocol,
                      const std::string& deadline, bool refitted) {
  ReachMethod method;
  method.key = std::string("intention") + (deadline == "adaptive" ? "" : "-" + deadline) +
               (refitted ? "-refit" : "");
  method.label = fmt::format("intention, {} deadline{}", deadline, refitted ? ", refitted" : "");
  method.protocol = protocol;
  if (refitted) method.settings = "refit 1";
  method.solve = [with, protocol, refitted](std::span<const ReachTask> tasks, int threads,
                                            const std::function<void()>&) {
    const int steps = tasks[0].num_steps, latent_size = with.network.LatentSize();
    std::vector<wandr::RolloutStart<float>> starts;
    std::vector<wandr::GoalPlan> plans;
    Eigen::MatrixXf latents(Eigen::Index{latent_size} * steps, tasks.size());
    for (std::size_t i = 0; i < tasks.size(); ++i) {
      starts.push_back(tasks[i].start);
      plans.push_back({{tasks[i].goal, tasks[i].deadline}});
      latents.col(static_cast<Eigen::Index>(i)) =
          wandr::DrawLatents(tasks[i].seed, tasks[i].stream, latent_size, steps, protocol.sigma);
    }
    wandr::RolloutRequest request;
    request.starts = starts;
    request.plans = plans;
    request.num_steps = steps;
    request.latents = &latents;
    std::vector<ReachSolution> solutions(tasks.size());
    wandr::RunRollouts(with.network, with.bones, request, threads,
                       {.intention = protocol.intention},
                       [&](int i, const wandr::RolloutTrack& track) {
                         solutions[i] = {track, latents.col(i), {}, {}};
                         wandr::RolloutTrack& made = solutions[i].track;
                         if (refitted) RefitToGoal(with.body, tasks[i].goal, made);
                       });
    return solutions;
  };
  return method;
}

ReachMethod VaeOpt(const ReachGenerator& with, const wandr::ReachProtocol& protocol,
                   const std::string& key, const std::string& label, VaeOptMethod optimizer) {
  VaeOptOptions options;
  options.method = optimizer;
  options.sigma = protocol.sigma;
  ReachMethod method;
  method.key = key;
  method.label = label;
  method.protocol = protocol;
  method.protocol.with_intention = false;
  method.settings = fmt::format(
      "iterations {}, goal sigma {} m, prior weight {}, history {}, learning rate {} to {} of it",
      options.NumIterations(), options.goal_sigma_m, options.prior_weight, options.history,
      options.learning_rate, options.last_learning_rate_ratio);
  method.solve = [with, options](std::span<const ReachTask> tasks, int threads,
                                 const std::function<void()>& poll) {
    VaeOptOptions polled = options;
    polled.poll = poll;
    return OptimizeAsPublished(with.network, with.bones, tasks, polled, threads);
  };
  return method;
}

// What is not a number here is not asked for by the protocol: obstacles, gaze, another joint.
std::string SettingsOf(const LatentOptions& o) {
  const nlohmann::json all = {
      {"with_intention", o.with_intention},
      {"min_frames_left", o.intention.min_frames_left},
      {"time", {o.free_time ? 1 : 0, o.hold_frames, o.late_frames}},
      {"soft_min", {o.soft_min_from_m, o.soft_min_to_m}},
      {"goal", o.goal},
      {"prior", o.prior},
      {"skate, creep, floor, airborne", {o.skate, o.creep, o.floor, o.airborne}},
      {"speed", {o.speed, o.fastest_m_s}},
      {"near", {o.near, o.farthest_stance_m}},
      {"path, limits, acceleration, look, balance",
       {o.path, o.limits, o.acceleration, o.look, o.balance}},
      {"along, cadence, turn, lean, collars",
       {o.along, o.cadence, o.turn, o.fastest_turn_rad_s, o.lean, o.farthest_lean_m,
        o.farthest_lean_reaching_m, o.collars}},
      {"height", {o.height, o.lowest_walk}},
      {"pace", "with the start's velocity"},
      {"lbfgs", o.lbfgs_iterations},
      {"lm", {o.lm_iterations, o.lm_goal_m}},
      {"hurries", o.hurries ? 2 : 0}};
  return JsonText(all);
}

ReachMethod LatentOpt(const ReachGenerator& with, const wandr::ReachProtocol& protocol,
                      const std::string& key, const std::string& label,
                      const LatentOptions& options, bool refit) {
  ReachMethod method;
  method.key = key;
  method.label = label;
  method.protocol = protocol;
  method.protocol.with_intention = options.with_intention;
  method.settings = SettingsOf(options) + (refit ? ", refit 2" : "");
  const LatentBody body = LatentBodyOf(with.body.rest_joints, with.body.sole_y);
  method.solve = [with, body, options, refit](std::span<const ReachTask> tasks, int threads,
                                              const std::function<void()>& poll) {
    // The protocol's deadlines count to the end of the last frame.
    std::vector<ReachTask> within(tasks.begin(), tasks.end());
    for (ReachTask& task : within) {
      task.deadline = std::min(task.deadline, task.num_steps);
      task.velocity = wandr::StartVelocity(with.network, task.start);
    }
    LatentOptions polled = options;
    polled.poll = poll;
    std::vector<ReachSolution> solutions =
        OptimizeLatents(with.network, body, within, polled, threads);
    if (!refit) return solutions;
    ParallelFor(static_cast<int>(solutions.size()), threads, [&](int i) {
      wandr::RolloutTrack& track = solutions[i].track;
      const RefitGoal goal{within[i].goal, within[i].deadline, true};
      track.states = RefitReach(with.body, track.states.cast<double>(), {&goal, 1}).cast<float>();
      track.joints = wandr::JointsOfStates(track.states, with.bones);
    });
    return solutions;
  };
  return method;
}

}  // namespace

const std::vector<std::string>& ReachMethodNames() {
  static const std::vector<std::string> names = {
      "intention",  "intention-refit",  "vae-opt-lbfgs-step1", "vae-opt-lbfgs", "vae-opt-adam",
      "vae-opt-lm", "latent-opt-prior", "latent-opt-raw",      "latent-opt"};
  return names;
}

std::vector<ReachMethod> ReachMethodsOf(const ReachMethodsOptions& options,
                                        const ReachGenerator& with) {
  const auto asked = [&](const std::string& name) {
    return std::ranges::any_of(options.methods, [&](const std::string& method) {
      return method == name || method == "all";
    });
  };
  const auto protocol = [&](wandr::ReachProtocol one) {
    one.num_samples = options.samples;
    one.sigma = options.sigma;
    one.seed = options.seed;
    return one;
  };
  const wandr::ReachProtocol adaptive = protocol(wandr::ReachProtocol::Adaptive());
  std::vector<ReachMethod> methods;
  if (asked("vae-opt-lbfgs-step1")) {
    methods.push_back(VaeOpt(with, adaptive, "vae-opt-lbfgs-step1",
                             "VAE + opt: L-BFGS, step 1 (as released)",
                             VaeOptMethod::kLbfgsStepOne));
  }
  if (asked("vae-opt-lbfgs")) {
    methods.push_back(VaeOpt(with, adaptive, "vae-opt-lbfgs", "VAE + opt: L-BFGS, line search",
                             VaeOptMethod::kLbfgs));
  }
  if (asked("vae-opt-lm")) {
    methods.push_back(
        VaeOpt(with, adaptive, "vae-opt-lm", "VAE + opt: Levenberg-Marquardt", VaeOptMethod::kLm));
  }
  if (asked("vae-opt-adam")) {
    methods.push_back(
        VaeOpt(with, adaptive, "vae-opt-adam", "VAE + opt: Adam", VaeOptMethod::kAdam));
  }
  for (const bool refitted : {false, true}) {
    if (!asked(refitted ? "intention-refit" : "intention")) continue;
    if (options.fixed) {
      methods.push_back(Intention(with, protocol(wandr::ReachProtocol()), "fixed", refitted));
    }
    if (options.adaptive) {
      methods.push_back(Intention(with, adaptive, "adaptive", refitted));
    }
  }
  if (asked("latent-opt-prior")) {
    LatentOptions blind;
    blind.with_intention = false;
    methods.push_back(LatentOpt(with, adaptive, "latent-opt-prior",
                                "latent-opt through the motion prior, not refitted", blind, false));
  }
  if (asked("latent-opt-raw")) {
    methods.push_back(
        LatentOpt(with, adaptive, "latent-opt-raw", "latent-opt, not refitted", {}, false));
  }
  if (asked("latent-opt")) {
    methods.push_back(LatentOpt(with, adaptive, "latent-opt", "latent-opt (ours)", {}, true));
  }
  return methods;
}

}  // namespace holdfast
