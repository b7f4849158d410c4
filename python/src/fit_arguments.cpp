// SPDX-License-Identifier: MIT
#include <algorithm>
#include <filesystem>

#include "geometry/error.h"
#include "geometry/io/mesh/mesh_io.h"
#include "python/src/fit.h"
#include "python/src/numpy.h"
#include "solver/carry/standing_grasp.h"
#include "solver/fit/energy.h"

namespace holdfast::python {
using namespace py::literals;

ModelPtr ModelOf(const py::object& body, const char* name) {
  if (body.is_none()) return BodyModel::Default();
  if (!py::isinstance<BodyModel>(body)) {
    throw py::type_error(std::string(name) + ": expected a BodyModel or None, got " +
                         TypeText(body));
  }
  return body.cast<ModelPtr>();
}

std::optional<GraspPlace::Wanted> PlaceOf(const py::object& at, const py::object& region,
                                          const py::object& avoid, double scale) {
  if (at.is_none() && region.is_none() && avoid.is_none()) return std::nullopt;
  GraspPlace::Wanted wanted;
  for (TriangleMesh* part : {&wanted.region, &wanted.avoid}) {
    part->vertices.resize(3, 0);
    part->faces.resize(3, 0);
  }
  if (!region.is_none()) wanted.region = MeshArgument(region, "region", scale);
  if (!avoid.is_none()) wanted.avoid = MeshArgument(avoid, "avoid", scale);
  if (!at.is_none()) wanted.at = Eigen::Map<const Eigen::Vector3d>(Floats(at, "at", {3}).data());
  return wanted;
}

void SetWeights(const py::object& weights, FitOptions& options) {
  if (weights.is_none()) return;
  if (!py::isinstance<py::dict>(weights)) {
    throw py::type_error("weights: expected a dict such as {'penetration': 3000.0}, got " +
                         TypeText(weights));
  }
  OptionTable table;
  AddWeightOptions(table, options, [](const EnergyTermInfo&) { return true; });
  for (const auto& [key, value] : weights.cast<py::dict>()) {
    const std::string name = py::str(key);
    if (table.Find("lambda_" + name) == nullptr) {
      std::string known;
      for (const EnergyTermInfo& info : EnergyTerms()) {
        known += fmt::format("{}'{}'", known.empty() ? "" : ", ", info.name);
      }
      throw py::value_error(
          fmt::format("weights: no term is called '{}'. There are: {}", name, known));
    }
    py::kwargs one;
    one[py::str("lambda_" + name)] = value;
    SetOptions(one, table);
  }
}

py::dict GraspDict(const Grasp& grasp) {
  const Eigen::Matrix4d wrist_from_object = grasp.wrist_from_object.matrix();
  py::dict dict = ToPython(GraspJson(grasp));
  dict["contacts_outside_place_ratio"] = grasp.outside_place;
  dict["from_point_mm"] = 1e3 * grasp.from_place_m;
  dict["fingers"] = py::array_t<double>(grasp.fingers.size(), grasp.fingers.data());
  dict["wrist_from_object"] = Rows(wrist_from_object.transpose());
  return dict;
}

nlohmann::json EnergiesJson(const FrameReport& frame) {
  nlohmann::json energies = {{"energy_total", frame.energy_total}};
  for (const EnergyTermInfo& info : EnergyTerms()) {
    if (info.metric != nullptr) energies[info.metric] = frame.energies[info.term];
  }
  return energies;
}

}  // namespace holdfast::python
