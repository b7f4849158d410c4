// SPDX-License-Identifier: MIT
#include "geometry/import/data_set_files.h"

#include <algorithm>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/import/fields.h"
#include "geometry/import/rotation_arrays.h"
#include "geometry/io/mesh/mesh_io.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;

constexpr int kMaxFoldersUp = 6;

}  // namespace

fs::path FindInDataSet(const fs::path& from, const std::string& name,
                       const ParameterOptions& options) {
  const fs::path relative = fs::path(name).lexically_normal();
  if (name.empty() || relative.is_absolute() || *relative.begin() == "..") return {};
  std::error_code ignored;
  const auto in = [&](const fs::path& folder) -> fs::path {
    return fs::is_regular_file(folder / relative, ignored) ? folder / relative : fs::path();
  };
  if (!options.data_root.empty()) {
    // The root itself, or the folder of sequences in it.
    for (const fs::path& folder : {options.data_root, options.data_root.parent_path()}) {
      if (const fs::path found = in(folder); !found.empty()) return found;
    }
  }
  fs::path folder = fs::absolute(from, ignored).parent_path();
  for (int i = 0; i <= kMaxFoldersUp && !folder.empty(); ++i) {
    if (const fs::path found = in(folder); !found.empty()) return found;
    if (folder == folder.parent_path()) break;
    folder = folder.parent_path();
  }
  return {};
}

void ReadSubject(const fs::path& from, const std::string& name, const ParameterOptions& options,
                 ImportedClip& imported) {
  const fs::path mesh = FindInDataSet(from, name, options);
  if (mesh.empty()) {
    imported.notes.push_back(fmt::format(
        "the subject's surface {} was not found beside the file or in the folders above it: the "
        "mean shape of {} stands in, which is off by centimetres (--data-root FOLDER says where "
        "the data set is)",
        name.empty() ? "(which the file does not name)" : name, options.body->Name()));
    return;
  }
  imported.clip.v_template = ReadMesh(mesh).vertices;
  fs::path betas = mesh;
  betas.replace_filename(mesh.stem().string() + "_betas.npy");
  std::error_code ignored;
  if (!fs::is_regular_file(betas, ignored)) return;
  const DataFile file(betas);
  const NpyMember member = file.Root().Array();
  const auto count = static_cast<Eigen::Index>(member.array.NumElements());
  imported.clip.betas = ReadFrameRows(file.Root(), std::max<Eigen::Index>(count, 1)).col(0);
}

void NoteTemplate(const BodyModel& body, ImportedClip& imported) {
  const Eigen::Index vertices = imported.clip.v_template.cols();
  if (vertices == 0 || vertices == body.NumVertices()) return;
  imported.notes.push_back(
      fmt::format("the subject's surface has {} vertices, {} has {}: it is kept in the clip, and "
                  "used with a body model of that many (--body)",
                  vertices, body.Name(), body.NumVertices()));
}

}  // namespace holdfast
