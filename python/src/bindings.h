// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <pybind11/pybind11.h>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"
#include "geometry/clip/clip_body.h"
#include "geometry/io/mesh/load_object.h"

namespace holdfast::python {

namespace py = pybind11;

using ClipPtr = std::shared_ptr<Clip>;
using ModelPtr = std::shared_ptr<const BodyModel>;

// One function per file of this folder; each adds its classes and functions to the module.
void BindClip(py::module_& module);
void BindBody(py::module_& module);
void BindMesh(py::module_& module);
void BindData(py::module_& module);
void BindTerms(py::module_& module);
void BindFit(py::module_& module);
void BindMotion(py::module_& module);
void BindScore(py::module_& module);

/// Thrown for work that the caller's progress stopped: holdfast.Stopped, a RuntimeError.
struct Stopped : std::runtime_error {
  Stopped() : std::runtime_error("stopped by progress") {}
};

/// The input is sound, yet there is no result (no grasp, no contact): holdfast.FitFailure, a
/// RuntimeError.
struct FitFailure : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Notes of the library go to logging.getLogger("holdfast") at level INFO.
void LogNotes(const std::vector<std::string>& notes);

/// A clip argument: a Clip, or what LoadClip takes (path or embedded name), with its body.
struct ClipArgument {
  ClipPtr clip;
  ClipBody body;
  std::string name;  ///< for messages
};
/// Throws TypeError for neither, and Error for a Clip whose numbers are out of range or whose
/// arrays differ in length. `model` is None for the embedded body.
ClipArgument ClipOf(const py::handle& value, const py::object& model, const char* name = "clip");

/// An object argument: a path or embedded name, or (vertices (V, 3), faces (F, 3)).
LoadedObject ObjectOf(const py::handle& value, double scale = 1.0, const char* name = "object");

/// "right" and the like as an enum; ValueError lists what is known.
template <typename Enum>
Enum Choice(const std::string& value, const char* name,
            const std::vector<std::pair<const char*, Enum>>& choices) {
  std::string known;
  for (const auto& [text, choice] : choices) {
    if (value == text) return choice;
    known += std::string(known.empty() ? "'" : ", '") + text + "'";
  }
  throw py::value_error(std::string(name) + ": expected one of " + known + ", got '" + value + "'");
}

}  // namespace holdfast::python
