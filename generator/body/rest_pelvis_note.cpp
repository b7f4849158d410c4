// SPDX-License-Identifier: MIT
#include "generator/body/rest_pelvis_note.h"

#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/body/skeleton.h"

namespace holdfast {
namespace {

constexpr const char* kName = "rest_pelvis";
constexpr std::string_view kMaker = "holdfast train";  // then the kind of network and version

std::string RestPelvis() { return fmt::format("{:.4f}", fmt::join(kEmbeddedRestPelvis, ",")); }

}  // namespace

void NoteRestPelvis(std::map<std::string, std::string>& notes) { notes[kName] = RestPelvis(); }

std::optional<std::string> OldPelvisWarning(const std::string& source,
                                            const std::map<std::string, std::string>& notes) {
  const auto made_by = notes.find("made_by"), pelvis = notes.find(kName);
  if (made_by == notes.end() || !made_by->second.starts_with(kMaker) ||
      (pelvis != notes.end() && pelvis->second == RestPelvis())) {
    return std::nullopt;
  }
  return fmt::format(
      "{}: was trained with an older rest pelvis of the embedded body, so positions are off by "
      "0.35 m. Train it again ('python3 -m holdfast.train{}'), unless it was trained with --body",
      source, made_by->second.substr(0, made_by->second.rfind(' ')).substr(kMaker.size()));
}

}  // namespace holdfast
