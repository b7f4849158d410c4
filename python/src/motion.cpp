// SPDX-License-Identifier: MIT
#include "python/src/motion.h"

#include <algorithm>
#include <utility>

#include <pybind11/stl.h>

#include "generator/body/rest_pelvis_note.h"
#include "generator/wandr/network.h"
#include "geometry/error.h"
#include "geometry/options.h"
#include "geometry/rotation.h"
#include "python/src/fit.h"
#include "python/src/numpy.h"
#include "python/src/run.h"
#include "solver/reach/reach_and_take.h"
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
  std::vector<std::optional<std::string>> why_missed;
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
    if (goals.back().cwiseAbs().maxCoeff() > kMaxMeters) {
      throw py::value_error(fmt::format("goals[{}]: {}", k / 3, kMetersRemedy));
    }
  }
  return goals;
}

std::vector<ReachObstacle> ObstaclesOf(const py::object& given, Side side, int threads) {
  std::vector<ReachObstacle> obstacles;
  if (given.is_none()) return obstacles;
  if (!py::isinstance<py::list>(given)) {
    throw py::type_error("obstacles: expected a list of mesh files or (vertices, faces)");
  }
  for (const py::handle& obstacle : given) {
    const std::string index = fmt::format("obstacles[{}]", obstacles.size());
    const std::string name = IsPath(obstacle) ? std::string(py::str(obstacle)) : index;
    const TriangleMesh mesh = MeshArgument(obstacle, index.c_str());
    obstacles.push_back(RunAside([name, mesh, side, threads] {
      return NamingSource("mesh", name, [&] { return MakeObstacle(name, mesh, side, threads); });
    }));
  }
  return obstacles;
}

py::object Reach(const py::object& goals, const py::object& clip, const std::optional<int>& frame,
                 const py::object& object, const py::object& approach, const py::object& obstacles,
                 const std::string& weights, const py::object& body, std::uint64_t seed,
                 int threads, const py::object& progress, const py::kwargs& given) {
  auto answer = std::make_shared<ReachAnswer>();
  answer->goals = GoalsOf(goals);
  ReachJob job;
  job.options.seed = seed;
  job.options.threads = ThreadsOf(threads);
  SetOptions(given, OptionsOf(job));
  if (clip.is_none() && frame) throw py::value_error("frame: needs clip");
  if (!approach.is_none()) {
    if (job.options.free_time) throw py::value_error("approach: not together with free_time");
    job.approach = Eigen::Map<const Eigen::Vector3d>(Floats(approach, "approach", {3}).data());
  }
  job.options.obstacles = ObstaclesOf(obstacles, job.options.side, job.options.threads);
  answer->options = ReachOptionsOf(job, !object.is_none());
  const ReachOptions& options = answer->options;
  const ModelPtr model = ModelOf(body);
  std::optional<ClipArgument> start;
  if (!clip.is_none()) start = ClipOf(clip, body);
  std::optional<TakeCall> take;
  if (!object.is_none()) {
    take = TakeOf(object, job, answer->goals, options);
  } else if (job.object_yaw_deg || job.object_scale != 1.0 || job.grasp) {
    throw py::value_error("grasp, object_yaw_deg, object_scale: need object");
  }
  ReachNetwork network;
  RunWithProgress(progress, [&](const StagedProgress& go_on) {
    network = LoadReachNetwork(weights);
    answer->person =
        start ? PersonInClip(*start->clip, start->body, frame, start->name) : StandingPerson(model);
    answer->warnings = CheckReachGoals(answer->goals, answer->person, options);
    if (const auto old = OldPelvisWarning(weights, network.weights.notes)) {
      answer->warnings.push_back(*old);
    }
    if (take) return;
    answer->report = WalkAndReach(answer->person, network.weights, answer->goals, options, go_on);
    if (answer->report.stopped) throw Stopped();
    RequireMade(answer->report, network.source);
    answer->why_missed = answer->report.why_missed;
    for (const ReachMotion& motion : answer->report.motions) {
      answer->clips.push_back(std::make_shared<Clip>(holdfast::ClipOf(motion, answer->person)));
    }
  });
  for (std::optional<std::string>& why : answer->why_missed) {
    if (why) why = PythonText(*why);
  }
  if (take) {
    return Take(*take, answer->person, network.weights, options, answer->warnings, progress);
  }
  return py::cast(answer);
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
          "clip", [](const ReachAnswer& self) { return self.clips.front(); }, "Clip: the best one")
      .def_property_readonly(
          "reached",
          [](const ReachAnswer& self) {
            const auto& goals = self.report.motions.front().sample.goals;
            py::array_t<bool> reached(static_cast<py::ssize_t>(goals.size()));
            std::ranges::transform(goals, reached.mutable_data(), &wandr::GoalOutcome::Reached);
            return reached;
          },
          "(K,) bool: which goals the best motion reaches, within 10 cm")
      .def_readonly("misses", &ReachAnswer::why_missed,
                    "list of K: why the best motion missed a goal, None if it reached the goal or "
                    "did not attempt it")
      .def_property_readonly(
          "goals",
          [](const ReachAnswer& self) {
            return ToPython(
                GoalsJson(self.report.motions.front().sample, self.goals, self.why_missed));
          },
          "list of K dict: outcome of each goal in the best motion; frames at 30 Hz")
      .def_property_readonly(
          "quality", [](const ReachAnswer& self) { return ToPython(QualitiesJson(self)); },
          "list of dict, one for each clip: goals reached, skating, time in the air, speed")
      .def_readonly("warnings", &ReachAnswer::warnings, "list of str: warnings about the goals")
      .def_property_readonly(
          "seconds", [](const ReachAnswer& self) { return self.report.seconds; },
          "time to generate the motions")
      .def("__repr__", [](const ReachAnswer& self) {
        return fmt::format("<holdfast.ReachResult: {} motions, the best reaches {} of {} goals>",
                           self.clips.size(), self.report.motions.front().sample.NumReached(),
                           self.goals.size());
      });
}

constexpr const char* kReachDoc =
    R"(Generates a walk to goals of the wrist, one after another.

With an object, which stands on a table at the first goal, the person takes it there and carries it
to the other goals. A missed goal does not raise.

Parameters
----------
goals : array_like (K, 3) or (3,)
    World, meters, z up from the ground.
clip : Clip, str or path, optional
    Continues from a frame of this clip. Default: a person of body who stands at the origin, facing
    -y.
frame : int, optional
    Frame of clip, from 0, at the clip's rate; default: the last.
object : str, path or (vertices, faces), optional
    Mesh, as in fit(). It stands on a table with the center of its base at the first goal.
approach : array_like (3,), optional
    Direction along the forearm, elbow to wrist, on arrival (latent-opt).
obstacles : list, optional
    Mesh files or (vertices, faces) in the world (latent-opt).
weights : str, optional
    File of another network.
body : BodyModel, optional
    In place of the embedded model.
seed : int, default 1
threads : int, default 0
    0: all.
progress : callable, optional
    Called with (stage, done, total); returning False stops the work.
@options

Returns
-------
ReachResult or TakeResult
    TakeResult with an object.

Raises
------
FitFailure
    If the motion diverges in every sample or the object cannot be taken.
Stopped
    If progress returns False.
Error
    For invalid goals.

Examples
--------
>>> reached = holdfast.reach([1.5, 1.0, 1.1])
>>> reached.clip, reached.reached, reached.misses
>>> taken = holdfast.reach([[1.5, 1.0, 0.8], [-0.5, 1.5, 1.1]], object='mug')
>>> taken.clip, taken.quality['goal_distance_m']
)";

}  // namespace

void BindMotion(py::module_& module) {
  BindReachResult(module);
  BindTake(module);
  ReachJob job;
  module.def("reach", &Reach, "goals"_a, py::kw_only(), "clip"_a = py::none(),
             "frame"_a = py::none(), "object"_a = py::none(), "approach"_a = py::none(),
             "obstacles"_a = py::none(), "weights"_a = "", "body"_a = py::none(), "seed"_a = 1,
             "threads"_a = 0, "progress"_a = py::none(),
             WithOptions(kReachDoc, OptionsOf(job)).c_str());
  BindSynthesize(module);
}

namespace {

// TakeResult.
struct TakenObject {
  ClipPtr clip;
  std::shared_ptr<const PreparedObject> object;
  TriangleMesh table;  // world
  std::string hand;
  nlohmann::json json;
  std::vector<std::string> warnings;
};

py::object PartOf(const TakenObject& self, const char* name) { return ToPython(self.json[name]); }

}  // namespace

TakeCall TakeOf(const py::object& object, const ReachJob& job,
                const std::vector<Eigen::Vector3d>& goals, const ReachOptions& options) {
  TakeCall call;
  call.request.side = options.side;
  call.request.places = goals;
  if (job.object_yaw_deg) call.request.object_yaw_rad = *job.object_yaw_deg * kDegree;
  call.request.style = job.grasp;
  call.request.seed = options.seed;
  call.request.threads = options.threads;
  const LoadedObject loaded = ObjectOf(object, job.object_scale);
  RequireGraspable(loaded, false);
  call.object = PrepareAside(loaded, 300, options.threads);
  LogNotes(call.object->notes);
  return call;
}

py::object Take(const TakeCall& call, const ReachPerson& person,
                const wandr::NetworkWeights& network, const ReachOptions& options,
                std::vector<std::string> warnings, const py::object& progress) {
  auto taken = std::make_shared<TakenObject>();
  RunWithProgress(progress, [&](const StagedProgress& go_on) {
    const TakeReport report =
        ReachAndTake(person, network, call.request, *call.object, options, go_on);
    if (report.status == TakeStatus::kStopped) throw Stopped();
    RequireTaken(report, call.object->object.name);
    taken->json = TakeJson(report);
    taken->hand = SideName(report.plan.side);
    taken->table = report.table.Mesh();
    Eigen::Matrix3Xd& corners = taken->table.vertices;
    corners = ((report.table.world_from_table.linear() * corners).colwise() +
               report.table.world_from_table.translation())
                  .eval();
    taken->clip = WithSurface(report.clip, call.object->object.mesh);
    warnings.insert(warnings.end(), report.notes.begin(), report.notes.end());
  });
  taken->object = call.object;
  taken->warnings = std::move(warnings);
  return py::cast(taken);
}

void BindTake(py::module_& module) {
  py::class_<TakenObject, std::shared_ptr<TakenObject>>(
      module, "TakeResult", "A person walks to an object on a table, takes it and carries it on.")
      .def_readonly("clip", &TakenObject::clip,
                    "Clip at 30 Hz with the object, fitted from the take on, and holding_hand")
      .def_readonly("hand", &TakenObject::hand, "'right' or 'left'")
      .def_property_readonly(
          "object", [](const TakenObject& self) { return MeshTuple(self.object->object.mesh); },
          "(vertices (V, 3) meters, faces (F, 3)), scaled; copies")
      .def_property_readonly(
          "table", [](const TakenObject& self) { return MeshTuple(self.table); },
          "(vertices (V, 3) meters, world, faces (F, 3)) of the table that it stood on; copies")
      .def_property_readonly(
          "take", [](const TakenObject& self) { return PartOf(self, "take"); },
          "dict: how it is taken: grasp, approach, object_yaw_deg, the table, and 'frames': "
          "arm_begins, on_line, arrives, taken, at_goals")
      .def_property_readonly(
          "quality", [](const TakenObject& self) { return PartOf(self, "summary"); },
          "dict of numbers: 'summary' of metrics.json, with units in the names: errors of the hand "
          "at the take, penetration of hand, body and object in each other and in the table, tilt "
          "and acceleration of the object, goal_distance_m")
      .def_property_readonly(
          "per_frame", [](const TakenObject& self) { return PartOf(self, "per_frame"); },
          "dict of lists of T: object_tilt_deg, arm_lacks_mm, hand_error_deg, max_penetration_mm, "
          "min_distance_mm")
      .def_readonly("warnings", &TakenObject::warnings, "list of str: warnings")
      .def("__repr__", [](const TakenObject& self) {
        return fmt::format("<holdfast.TakeResult: {} taken with the {} hand, {} frames>",
                           self.object->object.name, self.hand, self.clip->NumFrames());
      });
}

}  // namespace holdfast::python
