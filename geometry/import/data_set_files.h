// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "geometry/import/fields.h"

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

/// Whether `a` comes before `b` the way people number things: "frame_9" before "frame_10".
bool NaturalLess(const std::string& a, const std::string& b);

/// The files of a folder that hold one clip frame by frame.
struct FrameFiles {
  std::vector<std::filesystem::path> files;  ///< in natural order
  int people = 1;                            ///< most that any frame has files of
  int missing = 0;                           ///< numbers left out between the first and the last
};

/// Finds them: `000001.pkl ...`; with several people `00001_0.npz, 00001_1.npz` (frame, person); or
/// `<frame>/000.pkl` (SMPLify-X). All of the extension that most files have, of .pkl .npz .npy
/// .json .pt .pth. Of several people the `person`-th is taken. Throws Error for a folder without
/// any and a person that is not there.
FrameFiles FindFrameFiles(const std::filesystem::path& folder, int person);

}  // namespace holdfast
