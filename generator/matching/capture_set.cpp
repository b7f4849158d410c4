// SPDX-License-Identifier: MIT
#include "generator/matching/capture_set.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <map>
#include <mutex>
#include <set>
#include <sstream>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/clip/resample.h"
#include "geometry/error.h"
#include "geometry/import/import_motion.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/container/json_file.h"
#include "geometry/parallel.h"

namespace holdfast {

using nlohmann::json;

void WriteManifest(const std::filesystem::path& path, const json& head,
                   const ManifestLines& lines) {
  std::string text = JsonText(head, 1);
  text.resize(text.size() - 2);  // "\n}"
  text += ",\n \"clips\": [";
  const char* between = "\n  ";
  for (const auto& [index, line] : lines) {
    text += between + JsonText(line);
    between = ",\n  ";
  }
  WriteAtomically(path, text + "\n ]\n}\n");
}

ManifestLines LinesBefore(const std::filesystem::path& path, const json& head,
                          std::string_view command, std::string_view made_from, bool replace) {
  if (!std::filesystem::exists(path)) return {};
  const json before = ReadJson(path);
  const auto same = [&](const std::string& key) {
    if (!before.is_object() || !before.contains(key)) return false;
    json asked = head.at(key), had = before[key];
    for (json* const value : {&asked, &had}) {  // a larger set may be requested
      if (value->is_object()) value->erase("hours");
    }
    return asked == had;
  };
  if (!same("schema")) {
    throw Error(path.string(), fmt::format("is not a manifest of '{}'", command),
                "Choose another folder");
  }
  bool same_making = before.contains("clips");
  for (const auto& [key, value] : head.items()) same_making = same_making && same(key);
  if (!same_making) {
    if (replace) return {};
    throw Error(path.string(),
                fmt::format("was made with different {}, options, seed or version", made_from),
                "Choose another folder, or give --force to make it again");
  }
  return UseJson(path, [&] {
    ManifestLines lines;
    for (const json& line : before["clips"]) lines[line.at("index").get<int>()] = line;
    return lines;
  });
}

void DropLost(ManifestLines& lines, const std::filesystem::path& folder) {
  std::erase_if(lines, [&](const ManifestLines::value_type& line) {
    return line.second.contains("file") &&
           !std::filesystem::exists(folder / line.second.at("file").get<std::string>());
  });
}

namespace {

namespace fs = std::filesystem;

constexpr double kFrameRate = MotionLibrary::kFrameRate;
const std::set<std::string, std::less<>> kWalking = {"",     "walk",        "turn", "idle",
                                                     "step", "walk_circle", "stand"};

// Splits a CSV line. Quoted fields may contain commas; a doubled quote is a literal quote.
std::vector<std::string> Fields(const std::string& line) {
  std::vector<std::string> fields(1);
  bool quoted = false;
  for (std::size_t k = 0; k < line.size(); ++k) {
    const char c = line[k];
    if (c == '"' && quoted && k + 1 < line.size() && line[k + 1] == '"') {
      fields.back() += line[++k];
    } else if (c == '"') {
      quoted = !quoted;
    } else if (c == ',' && !quoted) {
      fields.emplace_back();
    } else if (c != '\r') {
      fields.back() += c;
    }
  }
  return fields;
}

double Number(const std::string& text, const std::string& where, const char* column) {
  double value = 0.0;
  std::istringstream stream(text);
  if (!(stream >> value) || !stream.eof()) {
    throw Error(where, fmt::format("{} is '{}'", column, text), "Give a number");
  }
  return value;
}

std::vector<Capture> ReadIndex(const fs::path& index) {
  std::istringstream text(ReadFile(index));
  std::string line;
  std::getline(text, line);
  const std::vector<std::string> header = Fields(line);
  const auto column = [&](std::string_view name) {
    return static_cast<std::size_t>(std::find(header.begin(), header.end(), name) - header.begin());
  };
  for (const char* needed : {"file", "subject"}) {
    if (column(needed) == header.size()) {
      throw Error(index.string(), fmt::format("has no column '{}'", needed),
                  "Name the columns in the first line: file,subject,category,...");
    }
  }
  std::vector<Capture> captures;
  for (int number = 2; std::getline(text, line); ++number) {
    if (line.empty()) continue;
    const std::vector<std::string> fields = Fields(line);
    const std::string where = fmt::format("{}, line {}", index.string(), number);
    if (fields.size() != header.size()) {
      throw Error(where,
                  fmt::format("has {} fields, but the header has {}", fields.size(), header.size()),
                  "Give every column; leave unknown values empty");
    }
    const auto field = [&](std::string_view name) -> std::string {
      const std::size_t at = column(name);
      return at < fields.size() ? fields[at] : std::string();
    };
    Capture capture;
    capture.file = field("file");
    capture.name = CaptureName(capture.file);
    capture.subject = field("subject");
    capture.category = field("category");
    constexpr std::string_view kSameTake = "same take as CMU ";
    const std::string note = field("note");
    if (const auto at = note.find(kSameTake); at != std::string::npos) {
      capture.subject = "cmu_" + note.substr(at + kSameTake.size(), 2);
    }
    if (!field("key_frame").empty()) {
      const double fps = field("fps").empty() ? kFrameRate : Number(field("fps"), where, "fps");
      capture.mark_s = Number(field("key_frame"), where, "key_frame") / fps;
      const std::string hand = field("hand");
      if (hand != "right" && hand != "left") {
        throw Error(where, fmt::format("hand is '{}'", hand), "Give right or left");
      }
      capture.wrist = hand == "right" ? Side::kRight : Side::kLeft;
    }
    captures.push_back(std::move(capture));
  }
  return captures;
}

Clip Import(const fs::path& file, const RetargetBody& body) {
  if (file.extension() != ".npz") return ImportMotion(file, body);
  return Resample(ReadClip(file), kFrameRate);
}

constexpr std::array<const char*, 3> kSplits = {"train", "held_out", "dropped"};

// Path of the imported clip, or the path it has until it is sorted into a split.
fs::path KeptAt(const fs::path& cache, const Capture& capture) {
  const std::string file = capture.name + ".npz";
  for (const char* const split : kSplits) {
    if (fs::exists(cache / split / file)) return cache / split / file;
  }
  return cache / file;
}

// Returns whether the feet stay on the ground, the wrist is no faster than in taking an object, and
// the wrist is nearly at rest at the mark. This excludes leaps, catches and blows.
bool IsCalm(const Clip& clip, const ReachMark& mark, const RetargetBody& body) {
  constexpr double kFastestWrist = 3.2;  // m/s
  constexpr double kSlowEnough = 1.0;    // m/s, at the mark
  constexpr double kHighestSole = 0.08;  // meters
  const SolePoints soles(body.rest_joints, body.floor_y);
  const std::vector<BodyFrame> motion = BodyFrames(clip, body.rest_joints);
  Eigen::Vector3d before = Eigen::Vector3d::Zero();
  const int begin = std::max(0, mark.frame - 40);
  const int end = std::min(clip.NumFrames(), mark.frame + 36);
  for (int t = begin; t < end; ++t) {
    const BodyPlacement placed = Place(body.rest_joints, motion[static_cast<std::size_t>(t)]);
    const Eigen::Vector3d wrist = placed.joints.col(WristJoint(mark.wrist));
    const double fastest = std::abs(t - mark.frame) <= 1 ? kSlowEnough : kFastestWrist;
    if (t > begin && (wrist - before).norm() * kFrameRate > fastest) return false;
    if (soles.At(placed).row(2).minCoeff() > kHighestSole) return false;
    before = wrist;
  }
  return true;
}

// A set built from only part of the indexed files would look like the complete set.
void RequireFiles(const fs::path& folder, const std::vector<Capture>& captures) {
  constexpr std::size_t kMaxNamed = 5;
  std::vector<std::string> absent;
  for (const Capture& capture : captures) {
    std::error_code error;
    if (!fs::is_regular_file(folder / capture.file, error)) absent.push_back(capture.file);
  }
  if (absent.empty()) return;
  const std::size_t named = std::min(kMaxNamed, absent.size());
  throw Error((folder / "index.csv").string(),
              fmt::format("lists {} files, of which {} {} missing: {}{}", captures.size(),
                          absent.size(), absent.size() == 1 ? "is" : "are",
                          fmt::join(absent.begin(), absent.begin() + named, ", "),
                          absent.size() > named ? ", ..." : ""),
              "Put the files there, or remove their lines");
}

std::vector<Capture> ListCaptures(const fs::path& folder) {
  std::error_code error;
  if (!fs::is_directory(folder, error)) {
    throw Error(folder.string(), "is not a folder", "Give a folder of captured motion");
  }
  std::vector<Capture> captures;
  if (fs::exists(folder / "index.csv")) {
    captures = ReadIndex(folder / "index.csv");
    RequireFiles(folder, captures);
  } else {
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
      std::string file = fs::relative(entry.path(), folder).generic_string();
      const std::string plain = file.ends_with(".gz") ? file.substr(0, file.size() - 3) : file;
      const bool motion =
          plain.ends_with(".bvh") || plain.ends_with(".amc") || plain.ends_with(".npz");
      if (!entry.is_regular_file() || !motion) continue;
      Capture capture;
      capture.name = CaptureName(file);
      capture.subject = entry.path().parent_path().filename().string();
      capture.file = std::move(file);
      captures.push_back(std::move(capture));
    }
    std::ranges::sort(captures, {}, &Capture::file);
  }
  if (captures.empty()) {
    throw Error(folder.string(), "holds no motion", "Give a folder with .bvh, .amc or .npz files");
  }
  return captures;
}

void HoldOut(std::vector<Capture>& captures, const std::vector<std::string>& subjects) {
  std::map<std::string, int> frames;
  std::set<std::string> names;
  int total = 0;
  for (const Capture& capture : captures) {
    names.insert(capture.name);
    const int usable = capture.fault.empty() ? capture.clip.NumFrames() : 0;
    frames[capture.subject] += usable;
    total += usable;
  }
  std::set<std::string> out(subjects.begin(), subjects.end());
  for (const std::string& subject : subjects) {
    if (frames.count(subject) == 0 && names.count(subject) == 0) {
      std::vector<std::string> known;
      for (const auto& [name, count] : frames) known.push_back(name);
      throw Error("--held-out", fmt::format("there is no subject or clip '{}'", subject),
                  fmt::format("Subjects: {}", fmt::join(known, ", ")));
    }
  }
  if (subjects.empty()) {
    std::vector<std::pair<int, std::string>> by_frames;
    for (const auto& [name, count] : frames) {
      if (count > 0) by_frames.emplace_back(count, name);
    }
    std::sort(by_frames.begin(), by_frames.end());
    int held = 0;
    for (const auto& [count, name] : by_frames) {
      if (10 * (held + count) > total) break;
      held += count;
      out.insert(name);
    }
  }
  for (Capture& capture : captures) {
    capture.held_out = out.count(capture.subject) > 0 || out.count(capture.name) > 0;
  }
}

// Returns false if canceled.
bool ImportAll(const fs::path& folder, const fs::path& cache, const RetargetBody& target,
               int threads, const StagedProgress& progress, std::vector<Capture>& captures) {
  std::error_code error;
  fs::create_directories(cache, error);
  if (error) {
    throw Error(cache.string(), fmt::format("cannot be created ({})", error.message()),
                "Check its parent folder");
  }
  const SolePoints soles(target.rest_joints, target.floor_y);
  JointLimits unlimited;
  unlimited.fill(10.0);
  std::mutex lock;
  std::atomic<bool> stopped = false;
  int done = 0;
  const int count = static_cast<int>(captures.size());
  ParallelFor(count, threads, [&](int k) {
    if (stopped) return;
    Capture& capture = captures[static_cast<std::size_t>(k)];
    const fs::path source = folder / capture.file;
    const fs::path kept = KeptAt(cache, capture);
    bool imported = false;
    try {
      std::error_code missing, ignored;
      const auto made = fs::last_write_time(kept, missing);
      imported = missing || made < fs::last_write_time(source, ignored);
      capture.clip = imported ? Import(source, target) : ReadClip(kept);
      capture.quality =
          MeasureQuality(target.rest_joints, soles, BodyFrames(capture.clip, target.rest_joints),
                         unlimited, &capture.statistics);
      capture.fault = FaultOf(capture.quality);
    } catch (const Error& fault) {
      capture.fault = fault.what();
    }
    if (imported && capture.clip.NumFrames() > 0) {  // a full disk is not a fault of the clip
      capture.clip.subject = capture.subject;
      capture.clip.action = capture.category;
      WriteClip(capture.clip, kept);
    }
    const std::scoped_lock guard(lock);
    ++done;
    if (progress && !progress("captured clips", done, count)) stopped = true;
  });
  return !stopped;
}

void SortClips(const fs::path& cache, const std::vector<Capture>& captures) {
  std::error_code error;
  for (const char* const split : kSplits) fs::create_directories(cache / split, error);
  for (const Capture& capture : captures) {
    const fs::path kept = KeptAt(cache, capture);
    const char* const split = kSplits[!capture.fault.empty() ? 2 : capture.held_out ? 1 : 0];
    const fs::path wanted = cache / split / kept.filename();
    if (kept == wanted || !fs::exists(kept)) continue;
    fs::rename(kept, wanted, error);
    if (error) {
      throw Error(wanted.string(), fmt::format("cannot be moved to ({})", error.message()),
                  "Check that the folder can be written");
    }
  }
}

ClipUse UseOf(const Capture& capture, const RetargetBody& body) {
  ClipUse use;
  use.walking = kWalking.count(capture.category) > 0;
  const int frames = capture.clip.NumFrames();
  int mark = static_cast<int>(std::lround(capture.mark_s * kFrameRate));
  if (capture.mark_s < 0.0 && capture.category == "pick_up") {
    double lowest = 0.85;  // meters; a higher wrist is not picking up
    const std::vector<BodyFrame> motion = BodyFrames(capture.clip, body.rest_joints);
    for (int t = 0; t < frames; ++t) {
      const double height =
          Place(body.rest_joints, motion[static_cast<std::size_t>(t)]).joints(2, 21);
      if (height < lowest) {
        lowest = height;
        mark = t;
      }
    }
  }
  const bool reaches =
      capture.category.empty() || capture.category == "reach" || capture.category == "pick_up";
  if (!reaches || mark < 20 || mark + 15 >= frames) return use;
  const ReachMark found{mark, capture.wrist};
  if (IsCalm(capture.clip, found, body)) use.reach = found;
  return use;
}

// Adds the training captures to the library, and all usable captures to the statistics.
void FillLibrary(const RetargetBody& target, CaptureSet& set) {
  std::vector<std::vector<BodyFrame>> moving;
  for (const Capture& capture : set.captures) {
    if (!capture.fault.empty()) {
      ++set.dropped;
      continue;
    }
    (capture.held_out ? set.held_out_minutes : set.train_minutes) +=
        capture.clip.NumFrames() / kFrameRate / 60.0;
    const ClipUse use = UseOf(capture, target);
    if (!use.walking && !use.reach) continue;
    (capture.held_out ? set.held_out : set.train).Add(capture.statistics);
    if (capture.held_out) continue;
    moving.push_back(BodyFrames(capture.clip, target.rest_joints));
    set.library.Add(capture.clip, capture.name, use);
    set.reach_sources += use.reach.has_value() ? 1 : 0;
  }
  set.library.Finish();
  set.joint_limits = LimitsOf(moving);
}

}  // namespace

std::string CaptureName(const std::string& file) {
  std::string name = file;
  for (const std::string_view ending : {".gz", ".bvh", ".amc", ".npz"}) {
    if (name.ends_with(ending)) name.resize(name.size() - ending.size());
  }
  std::replace(name.begin(), name.end(), '/', '_');
  return name;
}

std::optional<CaptureSet> ImportCaptures(const fs::path& folder, const fs::path& cache,
                                         const BodyModel& body,
                                         const std::vector<std::string>& held_out, int threads,
                                         const StagedProgress& progress) {
  const RetargetBody target = RetargetBodyOf(body);
  CaptureSet set{folder.filename().string(), body.Name(), ListCaptures(folder),
                 MotionLibrary(target.rest_joints, target.floor_y)};
  if (!ImportAll(folder, cache, target, threads, progress, set.captures)) return std::nullopt;
  HoldOut(set.captures, held_out);
  SortClips(cache, set.captures);
  FillLibrary(target, set);
  return set;
}

}  // namespace holdfast
