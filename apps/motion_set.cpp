// SPDX-License-Identifier: MIT
#include "apps/motion_set.h"

#include <algorithm>
#include <filesystem>

#include "apps/clip_input.h"
#include "geometry/clip/resample.h"
#include "geometry/error.h"

namespace holdfast::apps {
namespace {

namespace fs = std::filesystem;

constexpr double kRate = 30.0;  // Hz

std::vector<MotionFile> FilesBelow(const fs::path& folder) {
  std::vector<MotionFile> files;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
    const fs::path& path = entry.path();
    if (path.extension() != ".npz" || !entry.is_regular_file()) continue;
    if (path.filename() == "clip.npz" && fs::is_directory(path.parent_path() / "samples")) continue;
    files.push_back({path.string(), path.lexically_relative(folder).replace_extension().string()});
  }
  if (files.empty()) {
    throw Error(folder.string(), "has no clip (.npz) in it",
                "Give the folder that the clips are in");
  }
  std::ranges::sort(files, {}, &MotionFile::path);
  return files;
}

}  // namespace

std::vector<MotionFile> MotionFilesOf(const std::string& path) {
  if (fs::is_directory(path)) return FilesBelow(path);
  return {{path, fs::path(path).stem().string()}};
}

MotionReader::MotionReader(const std::string& body)
    : model_(LoadBody(body)), mean_(Make(model_, {})) {}

MotionReader::Person MotionReader::Make(const std::shared_ptr<const BodyModel>& model,
                                        const Eigen::VectorXd& betas) {
  return {MeasureBody(*model, betas),
          std::make_shared<const wandr::LowestPoint>(BodySurface(model, betas))};
}

LoadedMotion MotionReader::Read(const MotionFile& file, const CommonOptions& common) const {
  CommonOptions silent = common;  // one note for all motions is enough
  silent.quiet = true;
  LoadedClip loaded = LoadClip(file.path, model_, silent);
  Clip& clip = loaded.clip;
  const ClipBody& body = loaded.body;
  if (clip.frame_rate != kRate) clip = Resample(clip, kRate);
  const bool is_mean = body.model == model_ && (body.betas.size() == 0 || body.betas.isZero(0.0));
  const Person person = is_mean ? mean_ : Make(body.model, body.betas);
  LoadedMotion motion;
  motion.body.rest_joints = person.measures.rest_joints;
  motion.body.sole_y = person.measures.sole_y;
  motion.surface = person.surface;
  motion.body.surface = motion.surface.get();
  motion.frames = BodyFrames(clip, motion.body.rest_joints);
  motion.other_shape = is_mean && clip.betas.size() > 0 && !clip.betas.isZero(0.0);
  return motion;
}

}  // namespace holdfast::apps
