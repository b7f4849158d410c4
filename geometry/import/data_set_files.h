// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "geometry/import/fields.h"

namespace holdfast {

/// Finds a file whose name is given relative to the root of its data set: in `options.data_root`
/// and in the folders above `from`, going up. Empty if not found. Names that are absolute or leave
/// the root with ".." are not followed.
std::filesystem::path FindInDataSet(const std::filesystem::path& from, const std::string& name,
                                    const ParameterOptions& options);

/// Takes the first of `names` that FindInDataSet finds as the mesh of the object, with a note if
/// there is none.
void FindObjectMesh(const std::filesystem::path& from, std::span<const std::string> names,
                    const ParameterOptions& options, ImportedClip& imported);

/// Reads the surface of a subject from the .ply that a GRAB file names into `imported.clip`:
/// v_template, and betas from `<stem>_betas.npy` next to the .ply. Adds a note if there is none.
void ReadSubject(const std::filesystem::path& from, const std::string& name,
                 const ParameterOptions& options, ImportedClip& imported);

/// Whether these are poses of an object without a body: a rotation (`angles`, ...) and a
/// translation (`trans`, ...), as in InterAct's object.npz and BEHAVE's object_fit_all.npz.
bool LooksLikeObjectPoses(const Fields& fields);

/// Adds the object of the same sequence from a file next to the body's, whose frames are already in
/// `imported`: x_world = R x_object + T, in the file's world. The file is found by name (human.npz:
/// object.npz; smpl_fit_all.npz: object_fit_all.npz; ...), else by content if only one file
/// qualifies. The mesh is searched in objects/<name>/<name>.obj of the folders above, as in
/// InterAct. Warns if an object is found but not taken.
void AddObjectBeside(const std::filesystem::path& body, const ParameterOptions& options,
                     ImportedClip& imported);

/// Adds a note if the template belongs to another body model than the one in use.
void NoteTemplate(const BodyModel& body, ImportedClip& imported);

/// Whether `a` comes before `b` in natural order: "frame_9" before "frame_10".
bool NaturalLess(const std::string& a, const std::string& b);

/// Finds the files of a folder that hold one clip, one file per frame, in natural order:
/// `000001.pkl ...`; with several people `00001_0.npz, 00001_1.npz` (frame, person); or
/// `<frame>/000.pkl` (SMPLify-X). All have the most common extension among .pkl .npz .npy .json .pt
/// .pth. `person` selects one of several people; `notes` reports these, and missing numbers. Throws
/// Error for a folder without such files and for a person that is not there.
std::vector<std::filesystem::path> FindFrameFiles(const std::filesystem::path& folder, int person,
                                                  std::vector<std::string>& notes);

}  // namespace holdfast
