// SPDX-License-Identifier: MIT
#include <array>
#include <map>
#include <string>
#include <utility>

#include <pybind11/stl.h>

#include "geometry/mesh/distance_grid.h"
#include "python/src/fit.h"
#include "python/src/numpy.h"
#include "python/src/run.h"
#include "solver/carry/standing_grasp.h"
#include "solver/fit/clip_state.h"
#include "solver/grasp/grasp_both.h"
#include "solver/grasp/grasp_set_output.h"

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

std::string MeasuresText(const TriangleMesh& object) {
  const Eigen::Vector3d extent = 100.0 * Extent(object);
  return fmt::format("The object measures {:.1f} x {:.1f} x {:.1f} cm", extent.x(), extent.y(),
                     extent.z());
}

void RequireFound(const LoadedObject& object, const GraspReport& report,
                  const GraspOptions& options) {
  if (report.status == GraspStatus::kFound) return;
  if (report.status == GraspStatus::kStopped) throw Stopped();
  std::string why = fmt::format("{}: {}", object.name, Describe(report.status));
  if (!report.candidates.empty()) why += " (best try: " + report.candidates.front().refused + ")";
  throw FitFailure(
      fmt::format("{}. {}; a hand spans about 10 cm. {}, or try --closings {} --seed {}", why,
                  MeasuresText(object.mesh),
                  options.place ? "Choose another place" : "Check its unit (--object-scale)",
                  4 * options.closings, options.seed + 1));
}

// One hand of a standing person, or a hand alone.
void HoldInOneHand(const ModelPtr& body, Side side, GraspOptions options,
                   const std::optional<GraspPlace::Wanted>& place, const py::object& progress,
                   HeldObject& result) {
  const LoadedObject& object = result.object;
  StandingGrasp held;
  RunWithProgress(progress, [&](const StagedProgress& go_on) {
    if (const auto why = WhyTooLarge(object, false)) throw FitFailure(*why);
    if (place) options.place = std::make_shared<const GraspPlace>(object.mesh, *place);
    held = GraspStanding(body, side, object, options, [&](double share) {
      return go_on("grasp", static_cast<int>(100 * share), 100);
    });
    RequireFound(object, held.report, options);
  });
  result.clip = WithSurface(std::move(held.clip), object.mesh);
  result.hand = SideName(side);
  const GraspReport& report = held.report;
  const ContactMetrics& contact = held.grasp.metrics;
  result.numbers = GraspDict(held.grasp);
  result.numbers.attr("update")(
      ToPython({{"hand_in_object_max_mm", contact.max_penetration_mm},
                {"hand_in_object_mean_mm", contact.mean_penetration_mm},
                {"contact_ratio", contact.contact_ratio},
                {"contact_threshold_mm", ContactProtocol{}.contact_threshold_mm},
                {"intersection_volume_cm3", contact.intersection_volume_cm3},
                {"search",
                 {{"places", report.oppositions},
                  {"placements", report.placements},
                  {"closed", report.closings},
                  {"refined", report.refinements},
                  {"search_ms", report.search_ms},
                  {"closing_ms", report.closing_ms},
                  {"refinement_ms", report.refinement_ms}}}}));
}

// Between both hands: of a person who stands with the forearms forward, or of a clip's first frame.
void HoldInTwoHands(const ClipBody& person, Clip clip, BothHandsOptions options,
                    std::optional<GraspPlace::Wanted> place, const py::object& progress,
                    HeldObject& result) {
  const LoadedObject& object = result.object;
  BothHandsGrasp grasp;
  RunWithProgress(progress, [&](const StagedProgress& go_on) {
    if (const auto why = WhyTooLarge(object, true)) throw FitFailure(*why);
    if (place) {
      place->span_m = options.max_width_m;
      options.place = std::make_shared<const GraspPlace>(object.mesh, *place);
    }
    const HandModel right(person.model, person.betas, Side::kRight);
    const HandModel left(person.model, person.betas, Side::kLeft);
    DistanceGridOptions grid_options;
    grid_options.threads = options.threads;
    const DistanceGrid grid(SignedDistance(object.mesh), grid_options);
    if (!go_on("grasp", 0, 100)) throw Stopped();
    grasp = HoldInBothHands(right, left, BodySurface(person.model, person.betas), clip.pose[0],
                            clip.trans.col(0), object.mesh, grid, options);
    go_on("grasp", 100, 100);
    if (grasp.status == GraspStatus::kFound) return;
    throw FitFailure(fmt::format(
        "{} in both hands: {}. {}. {}, or take a pose with both hands in front (--clip)",
        object.name, Describe(grasp.status), MeasuresText(object.mesh),
        options.place ? "Choose another place" : "Check its unit (--object-scale)"));
  });
  clip.pose[0] = grasp.pose;
  PutInHands(kHoldsRight | kHoldsLeft, object.name, grasp.world_from_object, clip);
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

HeldPtr CloseOn(const py::object& object, const std::string& hand, const std::string& style,
                const std::string& use, const py::object& at, const py::object& region,
                const py::object& avoid, const py::object& clip, const py::object& body,
                double object_scale, int closings, int refinements, double upright,
                std::uint64_t seed, int threads, const py::object& progress) {
  enum class Hands { kAuto, kRight, kLeft, kBoth };
  const Hands hands = Choice<Hands>(hand, "hand",
                                    {{"auto", Hands::kAuto},
                                     {"right", Hands::kRight},
                                     {"left", Hands::kLeft},
                                     {"both", Hands::kBoth}});
  GraspOptions options;
  options.style = StyleOf(style);
  options.use = UseOf(use);
  RequireBetween(closings, "closings", 1, 100'000);
  RequireBetween(refinements, "refinements", 1, 100'000);
  RequireBetween(upright, "upright", 0.0, 1e6);
  RequirePositive(object_scale, "object_scale");
  options.closings = closings;
  options.refinements = refinements;
  options.upright_weight = upright;
  options.seed = seed;
  options.threads = ThreadsOf(threads);
  if (!clip.is_none() && hands != Hands::kBoth) throw py::value_error("clip: needs hand='both'");
  const std::optional<GraspPlace::Wanted> place = PlaceOf(at, region, avoid, object_scale);
  const ModelPtr model = ModelOf(body);
  auto result = std::make_shared<HeldObject>();
  if (hands == Hands::kBoth) {
    RequireHands(*model, kHoldsRight | kHoldsLeft);
    ClipBody person{model, {}};
    Clip start;
    if (clip.is_none()) {
      start = StandWithForearmsForward(model);
    } else {
      const ClipArgument given = ClipOf(clip, body);
      start = Slice(*given.clip, 0, 1);
      person = given.body;
    }
    result->object = ObjectOf(object, object_scale);
    BothHandsOptions both;
    both.seed = seed;
    both.threads = options.threads;
    HoldInTwoHands(person, std::move(start), both, place, progress, *result);
  } else {
    const Side side = hands == Hands::kAuto    ? model->LoneHand().value_or(Side::kRight)
                      : hands == Hands::kRight ? Side::kRight
                                               : Side::kLeft;
    RequireHands(*model, HoldingBit(side));
    result->object = ObjectOf(object, object_scale);
    HoldInOneHand(model, side, options, place, progress, *result);
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

py::dict ManyGrasps(const py::object& object, int count, const std::string& hand,
                    const std::string& style, const std::string& use, const py::object& at,
                    const py::object& region, const py::object& avoid, const py::object& body,
                    double object_scale, double friction, double apart, double apart_angle,
                    std::uint64_t seed, int threads, const py::object& progress) {
  GraspSetOptions options;
  RequireBetween(count, "count", 1, 1'000'000);
  RequireBetween(friction, "friction", 0.01, 2.0);
  RequireBetween(apart, "apart", 0.0, 10.0);
  RequireBetween(apart_angle, "apart_angle", 0.0, 3.1416);
  RequirePositive(object_scale, "object_scale");
  options.count = count;
  options.apart_m = apart;
  options.apart_rad = apart_angle;
  options.search.style = StyleOf(style);
  options.search.use = UseOf(use);
  options.search.friction = friction;
  options.search.seed = seed;
  options.search.threads = ThreadsOf(threads);
  const std::optional<Side> asked = Choice<std::optional<Side>>(
      hand, "hand", {{"auto", std::nullopt}, {"right", Side::kRight}, {"left", Side::kLeft}});
  const std::optional<GraspPlace::Wanted> place = PlaceOf(at, region, avoid, object_scale);
  const ModelPtr model = ModelOf(body);
  const Side side = asked.value_or(model->LoneHand().value_or(Side::kRight));
  RequireHands(*model, HoldingBit(side));
  const LoadedObject loaded = ObjectOf(object, object_scale);
  StandingGraspSet held;
  RunWithProgress(progress, [&](const StagedProgress& go_on) {
    if (const auto why = WhyTooLarge(loaded, false)) throw FitFailure(*why);
    if (place) options.search.place = std::make_shared<const GraspPlace>(loaded.mesh, *place);
    held = GraspsStanding(model, side, loaded, options, [&](double share) {
      return go_on("grasps", static_cast<int>(count * share), count);
    });
    if (held.set.status == GraspStatus::kStopped) throw Stopped();
    if (held.set.grasps.empty()) {
      throw FitFailure(fmt::format("{}: {}. {}", loaded.name, Describe(held.set.status),
                                MeasuresText(loaded.mesh)));
    }
  });
  py::dict result = ArraysOf(GraspSetArrays(held.set, loaded.name, side));
  result["clip"] = WithSurface(std::move(held.clip), loaded.mesh);
  return result;
}

}  // namespace

void BindGrasp(py::module_& module) {
  py::class_<HeldObject, HeldPtr>(module, "GraspResult", "A grasp: one frame of who holds.")
      .def_readonly("clip", &HeldObject::clip, "Clip of one frame, with the object in the hand")
      .def_readonly("hand", &HeldObject::hand, "'right', 'left' or 'both'")
      .def_property_readonly(
          "numbers", [](const HeldObject& self) { return self.numbers.attr("copy")(); },
          "dict: measures of the grasp, 'fingers' (45,) axis-angle in radians and "
          "'wrist_from_object' (4, 4), which fit any pose of the body; of both hands by 'right' "
          "and 'left'")
      .def_property_readonly(
          "object", [](const HeldObject& self) { return MeshTuple(self.object.mesh); },
          "(vertices (V, 3) metres, faces (F, 3)), scaled; copies")
      .def("__repr__", [](const HeldObject& self) {
        return fmt::format("<holdfast.GraspResult: {} in hand '{}'>", self.object.name, self.hand);
      });
  const GraspOptions defaults;
  module.def(
      "grasp", &CloseOn, "object"_a, py::kw_only(), "hand"_a = "auto", "style"_a = "auto",
      "use"_a = "auto", "at"_a = py::none(), "region"_a = py::none(), "avoid"_a = py::none(),
      "clip"_a = py::none(), "body"_a = py::none(), "object_scale"_a = 1.0,
      "closings"_a = defaults.closings, "refinements"_a = defaults.refinements,
      "upright"_a = defaults.upright_weight, "seed"_a = 1, "threads"_a = 0,
      "progress"_a = py::none(),
      "Closes a hand around an object: a clip of one frame of a standing person who holds it.\n\n"
      "object, style, use, at, region and avoid as for fit(). hand: 'right', 'left', 'both' (the "
      "object "
      "between them), 'auto' (the right, or the only one of a MANO model). clip: with hand='both' "
      "the pose is its first frame's. closings: placements that the fingers are closed for, "
      "refinements: closed hands that are refined; upright: how much an object that stays upright "
      "is preferred. Returns GraspResult. Raises FitFailure where there is no grasp, Stopped, and "
      "Error.\n\n"
      "    held = holdfast.grasp('mug', style='handle')\n"
      "    held.numbers['fingers'], held.clip");
  const GraspSetOptions set;
  module.def(
      "grasps", &ManyGrasps, "object"_a, "count"_a = set.count, py::kw_only(), "hand"_a = "auto",
      "style"_a = "auto", "use"_a = "auto", "at"_a = py::none(), "region"_a = py::none(),
      "avoid"_a = py::none(), "body"_a = py::none(), "object_scale"_a = 1.0,
      "friction"_a = set.search.friction, "apart"_a = set.apart_m, "apart_angle"_a = set.apart_rad,
      "seed"_a = 1, "threads"_a = 0, "progress"_a = py::none(),
      "Many distinct grasps of an object: each touches, is at most 1 mm deep and holds the "
      "object's "
      "weight in every direction with this friction, as linear programs prove.\n\n"
      "object, style, use, at, region and avoid as for fit(); of a use that is asked for all are "
      "of that use, with 'auto' they come first. Two grasps are distinct when their wrists "
      "are `apart` metres from each other in the object's frame or turned by `apart_angle` "
      "radians. Returns a dict of arrays, best score first, those of grasps.npz: "
      "'wrist_from_object' and 'object_from_wrist' (N, 4, 4) metres, 'finger_pose' (N, 45) "
      "axis-angle in SMPL-X's order, 'style' (N,), 'least_friction' (N,), 'ball_lower' (N,), "
      "'contact_grasp' (C,), 'contact_point_object' and 'contact_normal_object' (C, 3) and more; "
      "and 'clip', a frame for each of the first 100. There may be fewer than `count`. Raises "
      "FitFailure where there is none, Stopped, and Error, also for a mesh that encloses no "
      "solid.\n\n"
      "    many = holdfast.grasps('mug', 50)\n"
      "    many['wrist_from_object'][0], many['finger_pose'][0]");
}

}  // namespace holdfast::python