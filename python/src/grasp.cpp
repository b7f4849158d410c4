// SPDX-License-Identifier: MIT
#include <array>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/stl.h>

#include "python/src/fit.h"
#include "python/src/numpy.h"
#include "python/src/run.h"
#include "solver/carry/standing_grasp.h"
#include "solver/fit/clip_state.h"
#include "solver/grasp/grasp_both.h"
#include "solver/grasp/grasp_set.h"
#include "solver/trial/trial.h"

namespace holdfast::python {
namespace {

using namespace py::literals;

// GraspResult.
struct HeldObject {
  ClipPtr clip;
  LoadedObject object;
  std::string hand;
  py::dict numbers;
};
using HeldPtr = std::shared_ptr<HeldObject>;

// Grasps with one hand, of a standing person or by itself.
void HoldInOneHand(const ModelPtr& body, Side side, GraspOptions options,
                   const std::optional<GraspPlace::Wanted>& place, const py::object& progress,
                   HeldObject& result) {
  const LoadedObject& object = result.object;
  StandingGrasp held;
  RunWithProgress(progress, [&](const StagedProgress& go_on) {
    RequireGraspable(object, false);
    if (place) options.place = std::make_shared<const GraspPlace>(object.mesh, *place);
    held = GraspStanding(body, side, object, options, [&](double share) {
      return go_on("grasp", static_cast<int>(100 * share), 100);
    });
    if (held.report.status == GraspStatus::kStopped) throw Stopped();
    RequireFound(held.report, object, options);
  });
  result.clip = WithSurface(std::move(held.clip), object.mesh);
  result.hand = SideName(side);
  result.numbers = GraspDict(held.grasp);
  nlohmann::json numbers = GraspContactJson(held.grasp);
  numbers["search"] = GraspSearchJson(held.report);
  result.numbers.attr("update")(ToPython(numbers));
}

// Grasps between both hands: of a person with forearms forward, or of a clip's first frame.
void HoldInTwoHands(const ClipBody& person, Clip clip, const BothHandsOptions& options,
                    const std::optional<GraspPlace::Wanted>& place, const py::object& progress,
                    HeldObject& result) {
  const LoadedObject& object = result.object;
  BothHandsGrasp grasp;
  RunWithProgress(progress, [&](const StagedProgress& go_on) {
    RequireGraspable(object, true);
    if (!go_on("grasp", 0, 100)) throw Stopped();
    grasp = HoldStanding(person, object, place, options, clip);
    go_on("grasp", 100, 100);
  });
  result.clip = WithSurface(std::move(clip), object.mesh);
  result.hand = "both";
  result.numbers = py::dict("width_mm"_a = 1e3 * grasp.width_m, "upright_cosine"_a = grasp.upright,
                            "body_in_object_mm"_a = grasp.in_body_mm);
  for (int h = 0; h < 2; ++h) {
    py::dict numbers = GraspDict(grasp.hands[h]);
    numbers["wrist_shift_mm"] = grasp.wrist_shift_mm[h];
    numbers["wrist_turn_deg"] = grasp.wrist_turn_deg[h];
    result.numbers[h == 0 ? "right" : "left"] = numbers;
  }
}

HeldPtr CloseOn(const py::object& object, const py::object& at, const py::object& region,
                const py::object& avoid, const py::object& avoid_balls, const py::object& clip,
                const py::object& body, std::uint64_t seed, int threads, const py::object& progress,
                const py::kwargs& given) {
  GraspJob job;
  SetOptions(given, OptionsOf(job).Without({"apart_cm", "apart_angle_deg"}));
  job.search.seed = seed;
  job.search.threads = ThreadsOf(threads);
  const bool both = job.hands == GraspHands::kBoth;
  if (!clip.is_none() && !both) throw py::value_error("clip: needs hand='both'");
  const std::optional<GraspPlace::Wanted> place =
      PlaceOf(at, region, avoid, avoid_balls, job.object_scale);
  const ModelPtr model = ModelOf(body);
  auto result = std::make_shared<HeldObject>();
  if (both) {
    RequireHands(*model, kHoldsRight | kHoldsLeft);
    ClipBody person{model, {}};
    Clip start;
    if (clip.is_none()) {
      start = StandWithForearmsForward({model, {}});
    } else {
      const ClipArgument motion = ClipOf(clip, body);
      start = Slice(*motion.clip, 0, 1);
      person = motion.body;
    }
    result->object = ObjectOf(object, job.object_scale);
    BothHandsOptions options;
    options.seed = seed;
    options.threads = job.search.threads;
    HoldInTwoHands(person, std::move(start), options, place, progress, *result);
  } else {
    const Side side = HandFor(job.hands, *model);
    result->object = ObjectOf(object, job.object_scale);
    HoldInOneHand(model, side, job.search, place, progress, *result);
  }
  LogNotes(result->object.notes);
  return result;
}

py::dict ArraysOf(const std::map<std::string, NpyArray>& arrays) {
  py::dict dict;
  for (const auto& [name, array] : arrays) {
    const bool text = array.kind == 'U';
    const std::string type =
        fmt::format("{}{}", array.kind, text ? array.item_size / 4 : array.item_size);
    dict[name.c_str()] = py::array(py::dtype(type), array.shape, array.data.data());
  }
  return dict;
}

void AddTrials(const std::vector<HoldTrial>& trials, py::dict& result) {
  const auto count = static_cast<py::ssize_t>(trials.size());
  py::array_t<int> held(count);
  py::array_t<double> slip_mm(count), slip_deg(count);
  for (py::ssize_t i = 0; i < count; ++i) {
    const HoldTrial& trial = trials[static_cast<std::size_t>(i)];
    held.mutable_at(i) = trial.Held();
    slip_mm.mutable_at(i) = trial.WorstSlip_mm();
    slip_deg.mutable_at(i) = trial.WorstSlip_deg();
  }
  result["held_directions"] = held;
  result["worst_slip_mm"] = slip_mm;
  result["worst_slip_deg"] = slip_deg;
}

py::dict ManyGrasps(const py::object& object, int count, const py::object& at,
                    const py::object& region, const py::object& avoid,
                    const py::object& avoid_balls, const py::object& body,
                    const std::optional<double>& trial_friction, std::uint64_t seed, int threads,
                    const py::object& progress, const py::kwargs& given) {
  GraspJob job;
  SetOptions(given, OptionsOf(job).Without({"closings", "refinements", "upright"}));
  RequireBetween(count, "count", 1, 1'000'000);
  if (trial_friction) RequireBetween(*trial_friction, "trial_friction", 0.0, 100.0);
  if (job.hands == GraspHands::kBoth) {
    throw py::value_error("hand: expected one of 'auto', 'right', 'left', got 'both'");
  }
  GraspSetOptions options = job.many;
  options.count = count;
  options.search = job.search;
  options.search.seed = seed;
  options.search.threads = ThreadsOf(threads);
  const std::optional<GraspPlace::Wanted> place =
      PlaceOf(at, region, avoid, avoid_balls, job.object_scale);
  const ModelPtr model = ModelOf(body);
  const Side side = HandFor(job.hands, *model);
  const LoadedObject loaded = ObjectOf(object, job.object_scale);
  StandingGraspSet held;
  std::vector<HoldTrial> trials;
  RunWithProgress(progress, [&](const StagedProgress& go_on) {
    RequireGraspable(loaded, false);
    if (place) options.search.place = std::make_shared<const GraspPlace>(loaded.mesh, *place);
    held = GraspsStanding(model, side, loaded, options, [&](double share) {
      return go_on("grasps", static_cast<int>(count * share), count);
    });
    if (held.set.status == GraspStatus::kStopped) throw Stopped();
    RequireFound(held.set, loaded);
    if (trial_friction) {
      TrialProtocol protocol;
      protocol.scene.friction = *trial_friction;
      protocol.threads = options.search.threads;
      trials = TryGrasps(
          HandModel(model, {}, side), loaded.mesh, held.set.grasps, protocol,
          [&](double share) { return go_on("trials", static_cast<int>(count * share), count); });
    }
  });
  py::dict result = ArraysOf(GraspSetArrays(held.set, loaded.name, side));
  if (trial_friction) AddTrials(trials, result);
  result["clip"] = WithSurface(std::move(held.clip), loaded.mesh);
  return result;
}

constexpr const char* kGraspDoc =
    R"(Closes a hand around an object: a clip of one frame of a standing person who holds it.

Parameters
----------
object : str, path or (vertices, faces)
    Mesh file, name of an embedded object, or vertices (V, 3) in meters and faces (F, 3).
at : array_like (3,), optional
    Point where the object is grasped, in the object's frame, meters, scaled.
region : path or (vertices, faces), optional
avoid : path or (vertices, faces), optional
    Parts of the surface to touch and not to touch, as in fit().
avoid_balls : array_like (N, 4), optional
    Balls that the hand stays out of, as in fit().
clip : Clip, str or path, optional
    With hand='both': the pose is that of its first frame.
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
GraspResult

Raises
------
FitFailure
    If there is no grasp.
Stopped
    If progress returns False.
Error
    For invalid input.

Examples
--------
>>> held = holdfast.grasp('mug', style='handle')
>>> held.numbers['fingers'], held.clip
)";

constexpr const char* kGraspsDoc =
    R"(Searches many distinct grasps of an object.

Each grasp touches the object, is at most 1 mm deep and holds the object's weight in every direction
with the given friction, as certified by linear programs. If a use is given, all grasps are of that
use. With 'auto', grasps of the detected use come first.

Parameters
----------
object : str, path or (vertices, faces)
    Mesh file, name of an embedded object, or vertices (V, 3) in meters and faces (F, 3).
count : int, default 100
    Number of grasps; there may be fewer.
at : array_like (3,), optional
    Point where the object is grasped, in the object's frame, meters, scaled.
region : path or (vertices, faces), optional
avoid : path or (vertices, faces), optional
    Parts of the surface to touch and not to touch, as in fit().
avoid_balls : array_like (N, 4), optional
    Balls that the hand stays out of, as in fit().
body : BodyModel, optional
    In place of the embedded model.
trial_friction : float, optional
    MuJoCo tries each grasp with this coefficient of friction, as hold_trial() does.
seed : int, default 1
threads : int, default 0
    0: all.
progress : callable, optional
    Called with (stage, done, total); returning False stops the work.
@options

Returns
-------
dict of array
    Best score first, as in grasps.npz: 'wrist_from_object' and 'object_from_wrist' (N, 4, 4)
    meters, 'finger_pose' (N, 45) axis-angle in SMPL-X's order, 'style' (N,), 'least_friction' (N,),
    'ball_lower' (N,), 'contact_grasp' (C,), 'contact_point_object' and 'contact_normal_object'
    (C, 3) and more; and 'clip', with a frame for each of the first 100. trial_friction adds
    'held_directions' of 6, 'worst_slip_mm' and 'worst_slip_deg' (N,).

Raises
------
FitFailure
    If there is no grasp.
Stopped
    If progress returns False.
Error
    For invalid input, such as a mesh that does not enclose a solid.

Examples
--------
>>> many = holdfast.grasps('mug', 50)
>>> many['wrist_from_object'][0], many['finger_pose'][0]
)";

}  // namespace

void BindGrasp(py::module_& module) {
  py::class_<HeldObject, HeldPtr>(module, "GraspResult",
                                  "The result of a grasp search: a clip of one frame.")
      .def_readonly("clip", &HeldObject::clip, "Clip of one frame, with the object in the hand")
      .def_readonly("hand", &HeldObject::hand, "'right', 'left' or 'both'")
      .def_property_readonly(
          "numbers", [](const HeldObject& self) { return self.numbers.attr("copy")(); },
          "dict: measures of the grasp, 'fingers' (45,) axis-angle in radians and "
          "'wrist_from_object' (4, 4), which do not depend on the pose of the body; for both hands "
          "by 'right' and 'left'")
      .def_property_readonly(
          "object", [](const HeldObject& self) { return MeshTuple(self.object.mesh); },
          "(vertices (V, 3) meters, faces (F, 3)), scaled; copies")
      .def("__repr__", [](const HeldObject& self) {
        return fmt::format("<holdfast.GraspResult: {} in hand '{}'>", self.object.name, self.hand);
      });
  GraspJob job;
  module.def(
      "grasp", &CloseOn, "object"_a, py::kw_only(), "at"_a = py::none(), "region"_a = py::none(),
      "avoid"_a = py::none(), "avoid_balls"_a = py::none(), "clip"_a = py::none(),
      "body"_a = py::none(), "seed"_a = 1, "threads"_a = 0, "progress"_a = py::none(),
      WithOptions(kGraspDoc, OptionsOf(job).Without({"apart_cm", "apart_angle_deg"})).c_str());
  module.def("grasps", &ManyGrasps, "object"_a, "count"_a = GraspSetOptions{}.count, py::kw_only(),
             "at"_a = py::none(), "region"_a = py::none(), "avoid"_a = py::none(),
             "avoid_balls"_a = py::none(), "body"_a = py::none(), "trial_friction"_a = py::none(),
             "seed"_a = 1, "threads"_a = 0, "progress"_a = py::none(),
             WithOptions(kGraspsDoc, OptionsOf(job).Without({"closings", "refinements", "upright"}))
                 .c_str());
}

}  // namespace holdfast::python