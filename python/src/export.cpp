// SPDX-License-Identifier: MIT
#include <filesystem>
#include <optional>
#include <string>

#include <fmt/format.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "geometry/error.h"
#include "geometry/export/export_clip.h"
#include "python/src/fit.h"
#include "python/src/numpy.h"
#include "python/src/run.h"
#include "solver/trial/trial_clip.h"

namespace holdfast::python {
namespace {

using namespace py::literals;

py::dict Export(const py::object& clip, const std::filesystem::path& path, const py::object& object,
                double object_scale, const py::object& body,
                const std::optional<std::filesystem::path>& onto, bool force, int threads,
                const py::object& progress, const py::kwargs& given) {
  ExportOptions options;
  RequirePositive(object_scale, "object_scale");
  SetOptions(given, OptionsOf(options));
  options.onto = onto.value_or("");
  options.generator = "Holdfast " HOLDFAST_VERSION;
  options.threads = ThreadsOf(threads);
  ModelOf(body);
  ExportFormatOf(path);
  const ReportInput scene = SceneOf(clip, object, object_scale, body);
  if (!object.is_none() && !scene.clip.object) {
    throw Error("object", "is given, but the clip has no object trajectory",
                "Leave it out, or fit the object first (holdfast.fit)");
  }
  std::optional<TexturedMesh> look;
  if (IsPath(object)) {
    const std::filesystem::path mesh = py::str(object).cast<std::string>();
    if (mesh.extension() == ".obj") look = ReadTexturedObj(mesh, object_scale);
  }
  options.object_look = look ? &*look : nullptr;
  options.name = path.stem().string();
  for (const std::filesystem::path& file : ExportedFiles(scene, options, path)) {
    RequireNew(file, force);
  }
  ExportReport report;
  std::optional<MjcfPhysics> physics;
  if (ExportFormatOf(path) == ExportFormat::kMjcf) {
    TrialProtocol protocol;
    protocol.threads = options.threads;
    try {
      physics = PhysicsOfClip(scene, options.density_kg_m3, protocol);
    } catch (const Error& error) {  // if decomposition of the mesh fails
      LogNotes({fmt::format(
          "the object is exported as its convex hull and the hands as kinematic bodies: it {}",
          error.Problem())});
    }
  }
  options.physics = physics ? &*physics : nullptr;
  RunWithProgress(progress, [&](const StagedProgress& go_on) {
    report = ExportClip(scene, options, path, go_on);
  });
  py::dict told("files"_a = report.files, "object"_a = report.has_object);
  const bool skinned = report.format == ExportFormat::kGlb || report.format == ExportFormat::kUsda;
  if (skinned && !onto) {
    told["morph_targets"] = report.skin.morph_targets;
    told["surface_error_mm"] = 1e3 * report.skin.corrective_error_m;
  } else if (skinned) {
    told["skeleton"] = report.skeleton;
    told["joints"] = report.joints_moved;
  } else if (report.format == ExportFormat::kMjcf) {
    told["hand_pieces"] = report.mjcf.hand_pieces;
    told["simulated_hands"] = report.mjcf.simulated_hands;
    told["object_mass_kg"] = report.mjcf.object_mass_kg;
    told["mass_of_hull"] = report.mjcf.mass_of_hull;
  } else if (report.contact_hands > 0) {
    told["contact_points"] = report.contact_points;
    told["frames_in_contact"] = report.contact_frames;
  }
  return told;
}

constexpr const char* kExportDoc =
    R"(Writes a clip for other programs, in the format of the file's name.

- .glb: skinned body with pose correctives as morph targets, and the object, animated (meters, y
  up).
- .bvh: the skeleton (centimeters, y up).
- .usda: the same as .glb for USD (UsdSkel; meters, z up).
- .jsonl: poses of joints and object, and contacts, one line per frame.
- .xml: MJCF for MuJoCo: the object free, the holding hand simulated, one key frame per frame,
  meshes in a folder beside it.
- .npz: the clip.
- contacts.npz, contacts.csv: where hands touch the object.
- name_%04d.ply or .obj: a mesh of the body per frame, and of the object with 'object_' in the name.

Parameters
----------
clip : Clip, result, str or path
    Clip, result of fit(), refine(), grasp() or synthesize(), file, result folder, or name of an
    embedded clip.
path : path
object : str, path or (vertices, faces), optional
    Mesh in meters in place of the clip's, as in score().
object_scale : float, default 1.0
    Multiplies the object's coordinates.
body : BodyModel, optional
    In place of the embedded model.
onto : path, optional
    For .glb: a character (.glb, .gltf) whose skeleton is moved and whose skin is kept.
force : bool, default False
    Overwrite existing files.
threads : int, default 0
    0: all.
progress : callable, optional
    Called with (stage, done, total); returning False stops the work.
@options

Returns
-------
dict
    'files' written, 'object': whether the object is exported, and values of the format
    ('surface_error_mm', 'object_mass_kg', ...).

Raises
------
Error
    For an unknown format, for existing files and for contents that cannot be written.
Stopped
    If progress returns False.

Examples
--------
>>> holdfast.export(held, 'held.glb')
)";

}  // namespace

void BindExport(py::module_& module) {
  ExportOptions usual;
  module.def("export", &Export, "clip"_a, "path"_a, py::kw_only(), "object"_a = py::none(),
             "object_scale"_a = 1.0, "body"_a = py::none(), "onto"_a = py::none(),
             "force"_a = false, "threads"_a = 0, "progress"_a = py::none(),
             WithOptions(kExportDoc, OptionsOf(usual)).c_str());
}

}  // namespace holdfast::python
