// SPDX-License-Identifier: MIT
#include "solver/evaluation/capture_study.h"

#include <algorithm>
#include <cmath>
#include <mutex>

#include "geometry/error.h"
#include "geometry/import/load_clip.h"
#include "geometry/io/mesh/load_object.h"
#include "geometry/mesh/surface_distance.h"
#include "geometry/parallel.h"

namespace holdfast {
namespace {

bool IsCapture(const std::filesystem::path& path) {
  const std::string ending = path.extension().string();
  return ending == ".pt" || ending == ".npz" || ending == ".glb";
}

CaptureNumbers NumbersOf(const CarriedQuality& quality) {
  return {.jump_frames = quality.finger_jump_frames,
          .deep_frames = quality.contact.deep_frames,
          .deepest_mm = quality.contact.penetration_max_mm,
          .hand_frames_in_contact = quality.hand_frames_in_contact,
          .tips = quality.tips};
}

// How far both wrists went.
void MeasureWrists(const ObjectCapture& captured, const Clip& refined, CaptureRow& row) {
  const Eigen::Matrix3Xd rest = BodySurface(captured.body.model, captured.body.betas).RestJoints();
  double squares = 0.0;
  for (const Side side : {Side::kRight, Side::kLeft}) {
    const auto from = WristPoses(captured.clip, rest, side), to = WristPoses(refined, rest, side);
    for (std::size_t t = 0; t < from.size(); ++t) {
      const double mm = 1e3 * (to[t].translation() - from[t].translation()).norm();
      squares += mm * mm;
      row.wrist_max_mm = std::max(row.wrist_max_mm, mm);
    }
  }
  row.wrist_rms_mm = std::sqrt(squares / (2.0 * refined.NumFrames()));
}

CaptureRow Study(const ObjectCapture& captured) {
  CaptureRow row;
  row.name = captured.name;
  row.frames = captured.clip.NumFrames();
  row.seconds = row.frames / captured.clip.frame_rate;
  const double begin = CoreSeconds();
  try {
    const RefineReport report = RefineCarried(captured.clip, captured.body, *captured.object);
    if (report.status == RefineStatus::kNotFinite) {
      row.fault = "the solve came to numbers that are not finite";
    } else if (report.status == RefineStatus::kNoContact) {
      row.fault = "no hand touches the object in any frame";
    }
    for (const FingerRepair& fingers : report.fingers) {
      row.fingers_move |= fingers.moves;
      row.replaced += fingers.replaced;
    }
    row.before = NumbersOf(report.before);
    row.after = NumbersOf(report.after);
    row.hand_frames = report.after.hand_frames;
    row.object_rms_mm = report.distance.rms_mm;
    if (row.fault.empty()) MeasureWrists(captured, report.result.clip, row);
  } catch (const Error& error) {
    row.fault = error.what();
  }
  row.core_s = CoreSeconds() - begin;
  return row;
}

}  // namespace

std::vector<ObjectCapture> FindCaptures(const std::filesystem::path& folder,
                                        const std::shared_ptr<const BodyModel>& body, int every,
                                        int threads) {
  if (!std::filesystem::is_directory(folder)) {
    throw Error(folder.string(), "is not a folder", "Give one with clips that have an object");
  }
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file() && IsCapture(entry.path())) files.push_back(entry.path());
  }
  std::ranges::sort(files);
  ImportFileOptions import;
  import.frame_rate = 0.0;
  import.parameters.body = body;
  std::vector<ObjectCapture> captures;
  std::vector<std::shared_ptr<const PreparedObject>> objects;
  for (std::size_t k = 0; k < files.size(); k += static_cast<std::size_t>(every)) {
    const LoadedClip loaded = LoadClip(files[k].string(), import);
    if (!loaded.clip.object) continue;
    const ClipObject object = FindClipObject(loaded);
    if (!object.mesh) {
      throw Error(files[k].string(), "its object's mesh is missing: " + object.missing,
                  "Put it beside the clip");
    }
    auto known = std::ranges::find_if(objects, [&](const auto& prepared) {
      return SameSurface(prepared->object.mesh, *object.mesh);
    });
    if (known == objects.end()) {
      objects.push_back(std::make_shared<const PreparedObject>(PrepareObject(
          ObjectOfMesh(*object.mesh, loaded.clip.object->name, object.source), 300, threads)));
      known = objects.end() - 1;
    }
    captures.push_back(
        {files[k].lexically_relative(folder).string(), loaded.clip, loaded.body, *known});
  }
  if (captures.empty()) {
    throw Error(folder.string(), "holds no clip that has an object", "Check the path");
  }
  return captures;
}

CaptureNumbers& CaptureNumbers::operator+=(const CaptureNumbers& other) {
  jump_frames += other.jump_frames;
  deep_frames += other.deep_frames;
  deepest_mm = std::max(deepest_mm, other.deepest_mm);
  hand_frames_in_contact += other.hand_frames_in_contact;
  tips.touch += other.tips.touch;
  tips.beside += other.tips.beside;
  tips.inside += other.tips.inside;
  return *this;
}

double CaptureRow::DeepShare() const {
  return frames > 0 ? static_cast<double>(after.deep_frames) / frames : 0.0;
}

double CaptureRow::ContactShare() const {
  return hand_frames > 0 ? static_cast<double>(after.hand_frames_in_contact) / hand_frames : 1.0;
}

CaptureSums SumsOf(const std::vector<CaptureRow>& rows) {
  CaptureSums sums;
  double wrists = 0.0, objects = 0.0;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const CaptureRow& row = rows[k];
    if (!row.fault.empty()) continue;
    ++sums.refined;
    sums.flat += !row.fingers_move;
    CaptureRow& all = sums.all;
    all.frames += row.frames;
    all.seconds += row.seconds;
    all.replaced += row.replaced;
    all.hand_frames += row.hand_frames;
    all.before += row.before;
    all.after += row.after;
    all.core_s += row.core_s;
    all.wrist_max_mm = std::max(all.wrist_max_mm, row.wrist_max_mm);
    wrists += row.frames * row.wrist_rms_mm * row.wrist_rms_mm;
    objects += row.frames * row.object_rms_mm * row.object_rms_mm;
    if (!sums.worst_depth || row.after.deepest_mm > rows[*sums.worst_depth].after.deepest_mm) {
      sums.worst_depth = k;
    }
    if (!sums.worst_contact || row.ContactShare() < rows[*sums.worst_contact].ContactShare()) {
      sums.worst_contact = k;
    }
  }
  if (sums.all.frames > 0) {
    sums.all.wrist_rms_mm = std::sqrt(wrists / sums.all.frames);
    sums.all.object_rms_mm = std::sqrt(objects / sums.all.frames);
  }
  return sums;
}

std::vector<CaptureRow> StudyCaptures(const std::vector<ObjectCapture>& clips, int threads,
                                      const std::function<bool(int, int)>& progress) {
  std::vector<CaptureRow> rows(clips.size());
  std::mutex lock;
  int done = 0;
  const int total = static_cast<int>(clips.size());
  ParallelFor(total, threads, [&](int k) {
    rows[static_cast<std::size_t>(k)] = Study(clips[static_cast<std::size_t>(k)]);
    const std::scoped_lock guard(lock);
    if (progress && !progress(++done, total)) throw WorkStopped();
  });
  return rows;
}

}  // namespace holdfast
