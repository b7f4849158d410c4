// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>

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

/// Notes what a template of another body model than the one in use means.
void NoteTemplate(const BodyModel& body, ImportedClip& imported);

}  // namespace holdfast
