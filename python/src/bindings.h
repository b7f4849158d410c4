// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include <pybind11/pybind11.h>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"
#include "geometry/clip/clip_body.h"
#include "geometry/error.h"
#include "geometry/import/import_file.h"
#include "geometry/import/load_clip.h"
#include "geometry/object/load_object.h"
#include "geometry/options.h"
#include "geometry/report/report_page.h"

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
void BindPickling(py::module_& module);

/// Returns a docstring with the options of a table (OptionsText) in place of its line "@options".
std::string WithOptions(std::string_view doc, const OptionTable& table);

/// Rewrites the texts of all functions, methods and classes so that inspect.signature reads their
/// arguments, with the options that **kwargs stands for. Functions then raise TypeError with a
/// suggestion for an unknown keyword argument. Called when all are bound.
void GiveSignatures(py::module_& module);

/// Thrown if the progress callback stopped the work: holdfast.Stopped, a RuntimeError.
struct Stopped : std::runtime_error {
  Stopped() : std::runtime_error("stopped by progress") {}
};

/// Converts option names in a text of the library to Python: "--object-scale" becomes object_scale.
std::string PythonText(const std::string& text);

/// Sets options by name. Throws TypeError for unknown names and values of a wrong type, and
/// ValueError for values out of range.
void SetOptions(const py::kwargs& given, const OptionTable& table);

/// Throws Error if a file or folder exists, unless `force`. Called by writing functions before
/// their work.
void RequireNew(const std::filesystem::path& path, bool force);

/// Logs notes of the library to logging.getLogger("holdfast") at level INFO.
void LogNotes(const std::vector<std::string>& notes);

/// A clip argument: a Clip, a result that has one, or an argument of LoadClip (path or embedded
/// name), with its body.
struct ClipArgument {
  ClipPtr clip;
  ClipBody body;
  std::string name;            ///< for messages
  std::filesystem::path file;  ///< of the clip, as in LoadedClip
  bool imported = false;       ///< from a file of another program
  std::string other_body;      ///< BodyChange::from, if the clip was converted to `body`
};
/// Converts a clip argument. Throws TypeError for other types, and Error for a Clip with invalid
/// numbers or array lengths. `model` is None for the embedded body. `options` apply to files.
ClipArgument ClipOf(const py::handle& value, const py::object& model, const char* name = "clip",
                    ImportFileOptions options = {});

/// Returns `clip` (ClipOf, or a result with a clip) with its body, and the mesh of its object: the
/// given one, that of the result, or the one found.
ReportInput SceneOf(const py::object& clip, const py::object& object, double object_scale,
                    const py::object& body, const char* name = "clip");

/// Returns the clip in the form of LoadClip.
LoadedClip LoadedOf(const ClipArgument& clip);

/// Returns the mesh of the clip's object, from its track, its file or its name.
ClipObject OwnObject(const ClipArgument& clip, double scale = 1.0);
/// Returns the clip with this mesh as that of its object, for results.
ClipPtr WithSurface(Clip clip, const TriangleMesh& mesh);

/// Converts an object argument: a path or embedded name, or (vertices (V, 3), faces (F, 3)).
LoadedObject ObjectOf(const py::handle& value, double scale = 1.0, const char* name = "object");
/// Same; None means the clip's own object. Throws Error if it has none.
LoadedObject ObjectOf(const py::handle& value, const ClipArgument& clip, double scale);
/// Converts an object argument to a surface as it is in the file or arrays, without repairs.
TriangleMesh MeshArgument(const py::handle& value, const char* name, double scale = 1.0);
/// Returns (vertices (V, 3), faces (F, 3)), copied.
py::tuple MeshTuple(const TriangleMesh& mesh);

/// Converts "right" etc. to an enum. The ValueError for other texts lists the choices.
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
