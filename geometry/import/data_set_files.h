// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>

#include "geometry/import/fields.h"
#include "geometry/import/imported_clip.h"

namespace holdfast {

/// Looks for a file that another names relative to the root of its data set: in `options.data_root`
/// and, going up, in the folders that `from` lies in. Empty when it is nowhere. Names that are
/// absolute or climb out with ".." are not followed.
std::filesystem::path FindInDataSet(const std::filesystem::path& from, const std::string& name,
                                    const ParameterOptions& options);

/// The surface of a subject, as a GRAB .ply names it, into `imported.clip`: v_template, and betas
/// from `<stem>_betas.npy` beside it. Nothing found is a note.
void ReadSubject(const std::filesystem::path& from, const std::string& name,
                 const ParameterOptions& options, ImportedClip& imported);

/// Whether these are the poses of an object and of nobody: a rotation (`angles`, ...) and a
/// translation (`trans`, ...), as in InterAct's object.npz and BEHAVE's object_fit_all.npz.
bool LooksLikeObjectPoses(const Fields& fields);

/// Looks beside the file of a body, whose frames are there, for the object of the same sequence in
/// a file of its own, and makes it the clip's: x_world = R x_object + T, in the file's world. It
/// goes by the name (human.npz: object.npz; smpl_fit_all.npz: object_fit_all.npz; ...), else by
/// content where one other file may be it. The mesh is looked for as InterAct has it, in
/// objects/<name>/<name>.obj of the folders above. What is found and not taken is a warning.
void AddObjectBeside(const std::filesystem::path& body, const ParameterOptions& options,
                     ImportedClip& imported);

/// Notes what a template of another body model than the one in use means.
void NoteTemplate(const BodyModel& body, ImportedClip& imported);

}  // namespace holdfast
