// SPDX-License-Identifier: MIT
#include "python/src/take.h"

#include <utility>

#include <pybind11/stl.h>

#include "geometry/rotation.h"
#include "python/src/numpy.h"
#include "solver/reach/reach_json.h"

namespace holdfast::python {
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
  if (const auto why = WhyTooLarge(loaded, false)) throw FitFailure(*why);
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
          "(vertices (V, 3) metres, faces (F, 3)), scaled; copies")
      .def_property_readonly(
          "table", [](const TakenObject& self) { return MeshTuple(self.table); },
          "(vertices (V, 3) metres, world, faces (F, 3)) of the table that it stood on; copies")
      .def_property_readonly(
          "take", [](const TakenObject& self) { return PartOf(self, "take"); },
          "dict: how it is taken: grasp, approach, object_yaw_deg, the table, and 'frames': "
          "arm_begins, on_line, arrives, taken, at_goals")
      .def_property_readonly(
          "quality", [](const TakenObject& self) { return PartOf(self, "summary"); },
          "dict of numbers, units in the names, as metrics.json has them under 'summary': errors "
          "of "
          "the hand at the take, penetration of hand, body and object in each other and in the "
          "table, tilt and acceleration of the object, goal_distance_m")
      .def_property_readonly(
          "per_frame", [](const TakenObject& self) { return PartOf(self, "per_frame"); },
          "dict of lists of T: object_tilt_deg, arm_lacks_mm, hand_error_deg, max_penetration_mm, "
          "min_distance_mm")
      .def_readonly("warnings", &TakenObject::warnings, "list of str: what is not quite right")
      .def("__repr__", [](const TakenObject& self) {
        return fmt::format("<holdfast.TakeResult: {} taken with the {} hand, {} frames>",
                           self.object->object.name, self.hand, self.clip->NumFrames());
      });
}

}  // namespace holdfast::python
