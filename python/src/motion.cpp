// SPDX-License-Identifier: MIT
#include <algorithm>
#include <utility>

#include <pybind11/stl.h>

#include "generator/body/rest_pelvis_note.h"
#include "generator/wandr/reach_network.h"
#include "geometry/error.h"
#include "geometry/value_ranges.h"
#include "python/src/fit.h"
#include "python/src/numpy.h"
#include "python/src/run.h"
#include "python/src/take.h"
#include "solver/reach/reach_json.h"
#include "solver/reach/walk_and_reach.h"

namespace holdfast::python {
namespace {

using namespace py::literals;

// ReachResult.
struct ReachAnswer {
  std::vector<ClipPtr> clips;
  ReachReport report;
  ReachPerson person;
  ReachOptions options;
  std::vector<Eigen::Vector3d> goals;
  std::vector<std::string> warnings;
};
using ReachPtr = std::shared_ptr<ReachAnswer>;

std::vector<Eigen::Vector3d> GoalsOf(const py::object& value) {
  const py::array_t<double> numbers =
      Floats(value, "goals", Dimensions(value) == 1 ? Shape{3} : Shape{-1, 3});
  if (numbers.size() == 0) throw py::value_error("goals: expected one goal (3,) or more (K, 3)");
  std::vector<Eigen::Vector3d> goals;
  for (py::ssize_t k = 0; k < numbers.size(); k += 3) {
    goals.emplace_back(Eigen::Map<const Eigen::Vector3d>(numbers.data() + k));
    if (goals.back().cwiseAbs().maxCoeff() > kMostMetres) {
      throw py::value_error(fmt::format("goals[{}]: {}", k / 3, kMetresRemedy));
    }
  }
  return goals;
}

struct ReachArguments {
  const py::object& clip;
  const std::optional<int>& frame;
  const std::optional<std::string>& optimizer;
  const std::optional<int>& iterations;
  const std::optional<double>& prior_weight;
  const py::object& approach;
  const py::object& obstacles;
};

// Checks the options, and gives the obstacles' meshes with their names.
std::vector<std::pair<std::string, TriangleMesh>> CheckReach(const ReachArguments& in,
                                                             ReachOptions& options) {
  if (options.samples) RequireBetween(*options.samples, "samples", 1, 10'000);
  if (options.time_s) RequireBetween(*options.time_s, "time_s", 0.1, 60.0);
  RequireBetween(options.sigma, "sigma", 0.0, 3.0);
  if (options.by != ReachBy::kVaeOpt && (in.optimizer || in.iterations || in.prior_weight)) {
    throw py::value_error("optimizer, iterations, prior_weight: only method='vae-opt' sees them");
  }
  options.vae.method = Choice<VaeOptMethod>(in.optimizer.value_or("lm"), "optimizer",
                                            {{"lm", VaeOptMethod::kLm},
                                             {"lbfgs", VaeOptMethod::kLbfgs},
                                             {"lbfgs-step1", VaeOptMethod::kLbfgsStepOne},
                                             {"adam", VaeOptMethod::kAdam}});
  if (in.iterations) RequireBetween(*in.iterations, "iterations", 1, 100'000);
  options.vae.iterations = in.iterations.value_or(0);
  options.vae.prior_weight = in.prior_weight.value_or(options.vae.prior_weight);
  RequireBetween(options.vae.prior_weight, "prior_weight", 0.0, 1e6);
  if (in.clip.is_none() && in.frame) throw py::value_error("frame: needs clip");
  if (!in.approach.is_none()) {
    const py::array_t<double> numbers = Floats(in.approach, "approach", {3});
    const Eigen::Vector3d along = Eigen::Map<const Eigen::Vector3d>(numbers.data());
    if (along.norm() < 1e-6) throw py::value_error("approach: has no direction");
    if (options.free_time) throw py::value_error("approach: not together with free_time");
    options.approach = along.normalized();
  }
  std::vector<std::pair<std::string, TriangleMesh>> meshes;
  if (in.obstacles.is_none()) return meshes;
  if (!py::isinstance<py::list>(in.obstacles)) {
    throw py::type_error("obstacles: expected a list of mesh files or (vertices, faces)");
  }
  for (const py::handle& obstacle : in.obstacles) {
    const std::string name = fmt::format("obstacles[{}]", meshes.size());
    meshes.emplace_back(IsPath(obstacle) ? std::string(py::str(obstacle)) : name,
                        MeshArgument(obstacle, name.c_str()));
  }
  if (!meshes.empty() && options.by != ReachBy::kLatents) {
    throw py::value_error("obstacles: only method='latent-opt' sees them");
  }
  return meshes;
}

py::object Reach(const py::object& goals, const py::object& clip, const std::optional<int>& frame,
                 const py::object& object, const std::string& grasp,
                 const std::optional<double>& object_yaw_deg, double object_scale,
                 const std::string& wrist, const std::optional<std::string>& method,
                 const std::optional<std::string>& optimizer, const std::optional<int>& iterations,
                 const std::optional<double>& prior_weight, const std::optional<int>& samples,
                 const std::optional<double>& time_s, double sigma, bool refit, bool refit_all,
                 bool free_time, const py::object& approach, const py::object& obstacles,
                 const std::string& weights, const py::object& body, std::uint64_t seed,
                 int threads, const py::object& progress) {
  auto answer = std::make_shared<ReachAnswer>();
  ReachOptions& options = answer->options;
  answer->goals = GoalsOf(goals);
  options.by =
      Choice<ReachBy>(method.value_or(object.is_none() ? "intention" : "latent-opt"), "method",
                      {{"intention", ReachBy::kIntention},
                       {"latent-opt", ReachBy::kLatents},
                       {"vae-opt", ReachBy::kVaeOpt}});
  options.side = Choice<Side>(wrist, "wrist", {{"right", Side::kRight}, {"left", Side::kLeft}});
  options.samples = samples;
  options.time_s = time_s;
  options.sigma = sigma;
  options.refit = refit;
  options.refit_all = refit_all;
  options.free_time = free_time;
  options.seed = seed;
  options.threads = ThreadsOf(threads);
  auto meshes =
      CheckReach({clip, frame, optimizer, iterations, prior_weight, approach, obstacles}, options);
  const ModelPtr model = ModelOf(body);
  std::optional<ClipArgument> start;
  if (!clip.is_none()) start = ClipOf(clip, body);
  std::optional<TakeCall> take;
  if (!object.is_none()) {
    take = TakeOf(object, object_scale, grasp, object_yaw_deg, answer->goals, options);
  } else if (object_yaw_deg || object_scale != 1.0 || grasp != "auto") {
    throw py::value_error("grasp, object_yaw_deg, object_scale: need object");
  }
  ReachNetwork network;
  RunWithProgress(progress, [&](const StagedProgress& go_on) {
    network = LoadReachNetwork(weights);
    answer->person =
        start ? PersonInClip(*start->clip, start->body, frame, start->name) : StandingPerson(model);
    for (auto& [name, mesh] : meshes) {
      options.obstacles.push_back(NamingSource("mesh", name, [&, &file = name, &surface = mesh] {
        return MakeObstacle(file, std::move(surface), options.side, options.threads);
      }));
    }
    answer->warnings = CheckReachGoals(answer->goals, answer->person, options);
    if (const auto old = OldPelvisWarning(weights, network.weights.notes)) {
      answer->warnings.push_back(*old);
    }
    if (take) return;
    answer->report = WalkAndReach(answer->person, network.weights, answer->goals, options, go_on);
    if (answer->report.status == ReachStatus::kStopped) throw Stopped();
    if (answer->report.status == ReachStatus::kDiverged) {
      throw FitFailure(fmt::format(
          "{}: the motion stops being numbers in every sample (after {} frames in the best). Try "
          "another weights",
          network.source, answer->report.motions.front().sample.track.states.cols()));
    }
    for (const ReachMotion& motion : answer->report.motions) {
      answer->clips.push_back(std::make_shared<Clip>(holdfast::ClipOf(motion, answer->person)));
    }
  });
  if (take) {
    return Take(*take, answer->person, network.weights, options, answer->warnings, progress);
  }
  return py::cast(answer);
}

// Why a goal was missed; nothing where it was not.
std::optional<std::string> WhyMissed(const ReachAnswer& self, const ReachMiss& miss) {
  switch (miss.by) {
    case MissedBy::kNothing:
      break;
    case MissedBy::kHeight:
      return fmt::format("too high for this body, whose wrist comes to {:.2f} m",
                         self.person.HighestReach(self.options.side));
    case MissedBy::kObstacle:
      return "blocked: the goal is in an obstacle, or too near one for a hand";
    case MissedBy::kTime:
      return fmt::format("out of time: {:.1f} m in {:.1f} s is faster than a walk", miss.distance_m,
                         *self.options.time_s);
    case MissedBy::kMotion:
      return "no motion that the network makes came closer: try more samples, another seed or "
             "method='latent-opt'";
  }
  return std::nullopt;
}

nlohmann::json GoalsJson(const ReachAnswer& self) {
  nlohmann::json list = nlohmann::json::array();
  const auto frame = [](int number) {
    return number < 0 ? nlohmann::json() : nlohmann::json(number);
  };
  const wandr::ReachSample& best = self.report.motions.front().sample;
  for (std::size_t g = 0; g < self.goals.size(); ++g) {
    const wandr::GoalOutcome& goal = best.goals[g];
    const std::optional<std::string> why = WhyMissed(self, self.report.misses[g]);
    list.push_back(
        {{"goal_m", {self.goals[g].x(), self.goals[g].y(), self.goals[g].z()}},
         {"reached", goal.Reached()},
         {"taken_on_frame", frame(goal.taken_on)},
         {"due_frame", frame(goal.due)},
         {"reached_frame", frame(goal.reached)},
         {"left_frame", frame(goal.left)},
         {"closest_m", goal.taken_on >= 0 ? nlohmann::json(goal.closest_m) : nlohmann::json()},
         {"closest_frame", frame(goal.closest_frame)},
         {"why_missed", why ? nlohmann::json(*why) : nlohmann::json()}});
  }
  return list;
}

nlohmann::json QualitiesJson(const ReachAnswer& self) {
  nlohmann::json list = nlohmann::json::array();
  for (const ReachMotion& motion : self.report.motions) {
    list.push_back(MotionJson(motion));
  }
  return list;
}

void BindReachResult(py::module_& module) {
  py::class_<ReachAnswer, ReachPtr>(module, "ReachResult", "Motions to goals, best first.")
      .def_readonly("clips", &ReachAnswer::clips, "list of Clip at 30 Hz, best first")
      .def_property_readonly(
          "clip", [](const ReachAnswer& self) { return self.clips.front(); }, "the best one")
      .def_property_readonly(
          "reached",
          [](const ReachAnswer& self) {
            const auto& goals = self.report.motions.front().sample.goals;
            py::array_t<bool> reached(static_cast<py::ssize_t>(goals.size()));
            std::ranges::transform(goals, reached.mutable_data(), &wandr::GoalOutcome::Reached);
            return reached;
          },
          "(K,) bool: which goals the best motion reaches, within 10 cm")
      .def_property_readonly(
          "misses",
          [](const ReachAnswer& self) {
            std::vector<std::optional<std::string>> why;
            for (const ReachMiss& miss : self.report.misses) why.push_back(WhyMissed(self, miss));
            return why;
          },
          "list of K: why the best motion missed a goal, None where it did not or never set out")
      .def_property_readonly(
          "goals", [](const ReachAnswer& self) { return ToPython(GoalsJson(self)); },
          "list of K dict: what became of each goal in the best motion; frames at 30 Hz")
      .def_property_readonly(
          "quality", [](const ReachAnswer& self) { return ToPython(QualitiesJson(self)); },
          "list of dict, one for each clip: goals reached, skating, time in the air, speed")
      .def_readonly("warnings", &ReachAnswer::warnings, "list of str: what is hard about the goals")
      .def_property_readonly(
          "seconds", [](const ReachAnswer& self) { return self.report.seconds; },
          "of making the motions")
      .def("__repr__", [](const ReachAnswer& self) {
        return fmt::format("<holdfast.ReachResult: {} motions, the best reaches {} of {} goals>",
                           self.clips.size(), self.report.motions.front().sample.NumReached(),
                           self.goals.size());
      });
}

constexpr const char* kReachDoc = R"(A person walks to goals of the wrist, one after another.

goals: (K, 3) or (3,), world, metres, z up from the ground. clip: continues from this Clip, path or
embedded clip, at `frame` (from 0, at the clip's rate; None: the last); None: a person of `body` who
stands at the origin, facing -y. wrist: 'right' or 'left'.

object: a mesh that stands on a table at the first goal (the middle of its bottom), is taken there
and carried to the other goals; as for fit(), object_scale too. grasp: 'auto', 'power', 'precision',
'handle'. object_yaw_deg: of the standing object (None: what suits the hand).

method: 'intention' (the network, conditioned on the goal, runs once), 'latent-opt' (its latents are
then optimized), 'vae-opt' (WANDR's baseline); None: 'intention', or 'latent-opt' with an object.
For vae-opt: optimizer 'lm' (None), 'lbfgs', 'lbfgs-step1' (the released preset) or 'adam',
iterations at most, prior_weight lambda of lambda/2 |z|^2 beside 1/2 |wrist - goal|^2 in metres.
samples: motions to choose from (None: 16, or 4 where each is optimized). time_s: until each goal is
due (None: by its distance). sigma of the latents. refit: pin feet and place the wrist afterwards, in
the best motion or (refit_all) in all. For latent-opt: free_time, approach (3,) along the forearm on
arrival, obstacles: list of mesh files or (vertices, faces) in the world. weights: file of another
network.

Returns ReachResult, or with an object TakeResult; goals that are missed are no error. Raises
FitFailure where the network's numbers break in every sample or the object cannot be taken, Stopped,
and Error for goals that are out of the question.

    reached = holdfast.reach([1.5, 1.0, 1.1])
    reached.clip, reached.reached, reached.misses
    taken = holdfast.reach([[1.5, 1.0, 0.8], [-0.5, 1.5, 1.1]], object='mug')
    taken.clip, taken.quality['goal_distance_m'])";

}  // namespace

void BindMotion(py::module_& module) {
  BindReachResult(module);
  BindTake(module);
  module.def("reach", &Reach, "goals"_a, py::kw_only(), "clip"_a = py::none(),
             "frame"_a = py::none(), "object"_a = py::none(), "grasp"_a = "auto",
             "object_yaw_deg"_a = py::none(), "object_scale"_a = 1.0, "wrist"_a = "right",
             "method"_a = py::none(), "optimizer"_a = py::none(), "iterations"_a = py::none(),
             "prior_weight"_a = py::none(), "samples"_a = py::none(), "time_s"_a = py::none(),
             "sigma"_a = 1.0, "refit"_a = true, "refit_all"_a = false, "free_time"_a = false,
             "approach"_a = py::none(), "obstacles"_a = py::none(), "weights"_a = "",
             "body"_a = py::none(), "seed"_a = 1, "threads"_a = 0, "progress"_a = py::none(),
             kReachDoc);
  BindSynthesize(module);
}

}  // namespace holdfast::python
