// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <pybind11/pybind11.h>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"
#include "geometry/clip/clip_body.h"
#include "geometry/error.h"
#include "geometry/import/import_file.h"
#include "geometry/import/load_clip.h"
#include "geometry/io/mesh/load_object.h"
#include "geometry/options.h"
#include "geometry/report/report_facts.h"

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
void BindOptions(py::module_& module);
void BindFollow(py::module_& module);
void BindScore(py::module_& module);
void BindReport(py::module_& module);
void BindConvert(py::module_& module);
void BindExport(py::module_& module);
void BindMarkers(py::module_& module);
void BindRobot(py::module_& module);
void BindStudies(py::module_& module);
void BindTraining(py::module_& module);

/// Thrown for work that the caller's progress stopped: holdfast.Stopped, a RuntimeError.
struct Stopped : std::runtime_error {
  Stopped() : std::runtime_error("stopped by progress") {}
};

/// A text of the library, with its options as Python names them: "--object-scale" is object_scale.
std::string PythonText(const std::string& text);

/// Sets the options that are given by name. Throws TypeError for names that the table does not have
/// and values of a wrong type, and ValueError for values out of range.
void SetOptions(const py::kwargs& given, const OptionTable& table);

/// Throws Error for a file or folder that is there already, unless `force`. What writes calls this
/// before its work.
void RequireNew(const std::filesystem::path& path, bool force);

/// Notes of the library go to logging.getLogger("holdfast") at level INFO.
void LogNotes(const std::vector<std::string>& notes);

/// A clip argument: a Clip, or what LoadClip takes (path or embedded name), with its body.
struct ClipArgument {
  ClipPtr clip;
  ClipBody body;
  std::string name;            ///< for messages
  std::filesystem::path file;  ///< the clip's own, as of LoadedClip
  bool imported = false;       ///< of another program's file
  std::string other_body;      ///< BodyChange::from, where the file's clip was brought onto `body`
};
/// Throws TypeError for neither, and Error for a Clip whose numbers are out of range or whose
/// arrays differ in length. `model` is None for the embedded body. `options` are of files.
ClipArgument ClipOf(const py::handle& value, const py::object& model, const char* name = "clip",
                    ImportFileOptions options = {});

/// `clip` (ClipOf, or a result that has one) with its body, and the mesh of its object where that
/// is given, the result's or found.
ReportInput SceneOf(const py::object& clip, const py::object& object, double object_scale,
                    const py::object& body, const char* name = "clip");

/// The same as LoadClip gives it.
LoadedClip LoadedOf(const ClipArgument& clip);

/// The mesh of the clip's object, from its track, its file or by its name.
ClipObject OwnObject(const ClipArgument& clip, double scale = 1.0);
/// The clip, with this mesh as its object's: what a result is of.
ClipPtr WithSurface(Clip clip, const TriangleMesh& mesh);

/// An object argument: a path or embedded name, or (vertices (V, 3), faces (F, 3)).
LoadedObject ObjectOf(const py::handle& value, double scale = 1.0, const char* name = "object");
/// The same, or where it is None the clip's own. Throws Error where there is none.
LoadedObject ObjectOf(const py::handle& value, const ClipArgument& clip, double scale);
/// The same as a surface, a file's or arrays' as they are, nothing repaired.
TriangleMesh MeshArgument(const py::handle& value, const char* name, double scale = 1.0);
/// (vertices (V, 3), faces (F, 3)), copied.
py::tuple MeshTuple(const TriangleMesh& mesh);

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
