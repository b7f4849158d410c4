// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <pybind11/pybind11.h>
#include <nlohmann/json.hpp>

#include "python/src/bindings.h"
#include "solver/carry/carry.h"
#include "solver/carry/run_fit.h"
#include "solver/grasp/grasp.h"

namespace holdfast::python {

// Parts of BindFit and BindMotion.
void BindRefine(py::module_& module);
void BindTransfer(py::module_& module);
void BindGrasp(py::module_& module);
void BindCustomTerm(py::module_& module);
void BindFrameFitter(py::module_& module);
void BindSynthesize(py::module_& module);

/// Throws ValueError unless `low` <= `value` <= `high`; NaN is rejected.
template <typename Number>
void RequireBetween(Number value, const char* name, Number low, Number high) {
  if (value >= low && value <= high) return;
  throw py::value_error(fmt::format("{}: expected {} to {}, got {}", name, low, high, value));
}
inline void RequirePositive(double value, const char* name) {
  if (value > 0.0 && std::isfinite(value)) return;
  throw py::value_error(fmt::format("{}: expected more than 0, got {}", name, value));
}

/// Converts a body argument: a BodyModel, or None for the embedded one. Throws TypeError otherwise.
ModelPtr ModelOf(const py::object& body, const char* name = "body");

/// Returns the grasp location, or nullopt if all are None. Parts are MeshArgument with `scale`.
std::optional<GraspPlace::Wanted> PlaceOf(const py::object& at, const py::object& region,
                                          const py::object& avoid, const py::object& avoid_balls,
                                          double scale);

/// Sets weights by the names of EnergyTerms(). `weights` is None or a dict.
void SetWeights(const py::object& weights, FitOptions& options);

/// Measures of a grasp, with "fingers" (45,) and "wrist_from_object" (4, 4).
py::dict GraspDict(const Grasp& grasp);
nlohmann::json EnergiesJson(const FrameReport& frame);

/// FitResult: a successful fit.
struct CarriedClip {
  ClipPtr clip;
  FitJob job;
  FitRun run;
};
using CarriedPtr = std::shared_ptr<CarriedClip>;

/// Calls PrepareObject on another thread (RunAside), since it is slow for large meshes.
std::shared_ptr<const PreparedObject> PrepareAside(const LoadedObject& object, int vertices,
                                                   int threads);

/// Calls RunFit for a prepared object, without the interpreter lock. Appends messages for the log
/// to `notes`.
CarriedPtr Carry(const FitJob& job, LoadedClip motion, bool made,
                 std::shared_ptr<const PreparedObject> object, const StagedProgress& progress,
                 std::vector<std::string>& notes);

}  // namespace holdfast::python
