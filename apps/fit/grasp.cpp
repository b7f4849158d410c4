// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/clip_input.h"
#include "apps/common.h"
#include "apps/fit_job.h"
#include "geometry/clip/clip_arrays.h"
#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/mesh/mesh_io.h"
#include "solver/carry/run_fit.h"
#include "solver/carry/standing_grasp.h"
#include "solver/grasp/grasp_set.h"

namespace holdfast::apps {
namespace {

struct GraspCommand {
  CommonOptions common;
  GraspJob job;
  std::string object;
  std::string output;
  std::string body;
  std::string clip;
  int frame = 0;
  GraspPlaceInput place;
  int count = 0;
};

std::string TouchingText(const Grasp& grasp) {
  const auto parts = GraspJson(grasp)["touching"].get<std::vector<std::string>>();
  return fmt::format("{}", fmt::join(parts, ", "));
}

// Maximum penetration of skin into the object, or of the object surface into the hand.
double Deepest_mm(const Grasp& grasp) {
  return std::max(grasp.max_penetration_mm, grasp.object_in_hand_mm);
}

nlohmann::json CertificateJson(const Grasp& grasp) {
  if (!grasp.certificate) return nullptr;
  const GraspCertificate& certificate = *grasp.certificate;
  return {
      {"least_friction", certificate.least_friction ? nlohmann::json(*certificate.least_friction)
                                                    : nlohmann::json(nullptr)},
      {"ball_lower", certificate.ball_lower},
      {"ball_upper", certificate.ball_upper},
      {"friction", certificate.friction},
      {"length_m", certificate.length_m},
      {"contacts", certificate.contacts}};
}

// Describes the certificate, or why there is none.
std::string CertificateText(const Grasp& grasp, const TriangleMesh& object) {
  if (!grasp.certificate) return "no certificate: " + WhyNotSolid(object);
  const GraspCertificate& certificate = *grasp.certificate;
  if (!certificate.least_friction) return "does not hold the object's weight in every direction";
  return fmt::format("holds the object's weight in any direction with friction {:.2f} or more",
                     std::ceil(100.0 * *certificate.least_friction - 1e-6) / 100.0);
}

// The two output files.
struct GraspFiles {
  std::filesystem::path clip, mesh;
};

// Throws Error unless both files are new.
GraspFiles NewGraspFiles(const GraspCommand& options) {
  const std::filesystem::path output(options.output);
  std::filesystem::path mesh_path = output;
  mesh_path.replace_filename(output.stem().string() + "_object.ply");
  RequireNew(output, options.common);
  RequireNew(mesh_path, options.common);
  return {output, mesh_path};
}

LoadedObject LoadGraspable(const GraspCommand& options, bool both_hands) {
  LoadedObject object = LoadObject(options.object, options.job.object_scale);
  for (const std::string& note : object.notes) Note(options.common, "note: " + note);
  RequireGraspable(object, both_hands);
  return object;
}

void WriteGrasp(const LoadedObject& object, const GraspFiles& files, Clip& clip) {
  clip.object->mesh = files.mesh.filename().string();
  WriteMesh(object.mesh, files.mesh);
  WriteClip(clip, object.mesh, files.clip);
}

nlohmann::json GraspSummaryHead(const char* schema, const CommonOptions& common,
                                const GraspFiles& files, const LoadedObject& object,
                                std::string_view hand) {
  nlohmann::json summary = JsonHead(schema, common);
  summary["output"] = files.clip.string();
  summary["object"] = object.name;
  summary["object_mesh"] = files.mesh.string();
  summary["hand"] = hand;
  return summary;
}

void PrintGrasp(const GraspCommand& options, const GraspFiles& files, const LoadedObject& object,
                Side side, const Grasp& grasp, const GraspReport& report) {
  nlohmann::json summary =
      GraspSummaryHead("holdfast/grasp/1", options.common, files, object, SideName(side));
  summary["grasp"] = GraspJson(grasp);
  summary["certificate"] = CertificateJson(grasp);
  summary["grasp"]["use"] = UseName(report.use);
  summary["contact"] = GraspContactJson(grasp);
  if (options.job.search.place) {
    summary["place"] = GraspPlaceJson(options.place);
    summary["place"]["contacts_outside_ratio"] = grasp.outside_place;
    summary["place"]["from_point_mm"] = 1000.0 * grasp.from_place_m;
  }
  summary["search"] = GraspSearchJson(report);
  PrintResult(
      options.common, summary,
      fmt::format(
          "{}: {} grasp of {} ({}) with the {} hand ({})\n"
          "  {:.2f} mm deepest penetration, {:.0f} % of the hand in contact, quality {:.2f}\n"
          "  {}\n"
          "  {} of {} placements closed, {} refined in {:.1f} s\n",
          files.clip.string(), StyleName(grasp.style), object.name, UseName(report.use),
          SideName(side), TouchingText(grasp), Deepest_mm(grasp),
          100.0 * grasp.metrics.contact_ratio, grasp.wrench_quality,
          CertificateText(grasp, object.mesh), report.closings, report.placements,
          report.refinements,
          1e-3 * (report.search_ms + report.closing_ms + report.refinement_ms)));
}

// Sets the search options that are not in the option table.
void PrepareSearch(const LoadedObject& object, GraspCommand& options) {
  GraspOptions& search = options.job.search;
  if (const auto wanted = WantedPlace(options.place, options.object, options.job.object_scale)) {
    search.place = std::make_shared<const GraspPlace>(object.mesh, *wanted);
  }
  search.seed = options.common.seed;
  search.threads = NumThreads(options.common);
}

void WriteGrasps(const GraspCommand& options, const LoadedObject& object, Side side,
                 StandingGraspSet& held) {
  const std::filesystem::path folder(options.output);
  NpzWriter arrays;
  for (auto& [name, array] : GraspSetArrays(held.set, object.name, side)) {
    arrays.Add(name, std::move(array));
  }
  std::filesystem::create_directories(folder);
  arrays.Write(folder / "grasps.npz");
  WriteAtomically(folder / "grasps.csv", GraspSetCsv(held.set));
  WriteGrasp(object, {folder / "clip.npz", folder / "object.ply"}, held.clip);
}

void PrintGrasps(const GraspCommand& options, const LoadedObject& object, Side side,
                 const GraspSet& set) {
  nlohmann::json summary = JsonHead("holdfast/grasps/1", options.common);
  summary["output"] = options.output;
  summary["object"] = object.name;
  summary["hand"] = SideName(side);
  summary["use"] = UseName(set.use);
  summary["asked"] = options.count;
  summary["found"] = set.grasps.size();
  std::vector<double> frictions, depths;
  std::map<std::string, int> styles;
  for (const CertifiedGrasp& one : set.grasps) {
    frictions.push_back(one.grasp.certificate->least_friction.value_or(0.0));
    depths.push_back(Deepest_mm(one.grasp));
    ++styles[std::string(StyleName(one.grasp.style))];
  }
  const double seconds = 1e-3 * set.milliseconds;
  const double friction = *std::max_element(frictions.begin(), frictions.end());
  const double depth = *std::max_element(depths.begin(), depths.end());
  summary["styles"] = styles;
  summary["least_friction_max"] = friction;
  summary["deepest_mm_max"] = depth;
  summary["search"] = {{"placements", set.placements},
                       {"closed", set.closings},
                       {"refined", set.refinements},
                       {"search_ms", set.milliseconds}};
  PrintResult(
      options.common, summary,
      fmt::format("{}: {} distinct grasps of {} with the {} hand\n"
                  "  at most {:.2f} mm deep; each holds the object's weight in any direction with "
                  "friction {:.3f}\n"
                  "  {} placements closed, {} refined in {:.1f} s: {:.0f} grasps per second\n"
                  "  grasps.npz, grasps.csv; clip.npz shows the first {}, one per frame\n",
                  options.output, set.grasps.size(), object.name, SideName(side), depth, friction,
                  set.closings, set.refinements, seconds,
                  static_cast<double>(set.grasps.size()) / seconds,
                  std::min<std::size_t>(set.grasps.size(), kMaxShown)));
}

// Writes many distinct grasps into a folder. If fewer than requested are found, or after Ctrl-C,
// those found so far are written.
int RunMany(GraspCommand options) {
  const CommonOptions& common = options.common;
  RequireNewFolder(options.output, common);
  const std::shared_ptr<const BodyModel> body = LoadBody(options.body);
  const Side side = HandFor(options.job.hands, *body);
  const LoadedObject object = LoadGraspable(options, false);
  PrepareSearch(object, options);
  GraspSetOptions set_options = options.job.many;
  set_options.count = options.count;
  set_options.search = options.job.search;
  StandingGraspSet held;
  {
    Progress progress(common, "grasps");
    held = GraspsStanding(body, side, object, set_options, [&](double share) {
      progress.Update(static_cast<int>(options.count * share), options.count);
      return !Interrupted();
    });
  }
  const bool stopped = held.set.status == GraspStatus::kStopped;
  if (stopped && held.set.grasps.empty()) return kInterrupted;
  RequireFound(held.set, object);
  WriteGrasps(options, object, side, held);
  PrintGrasps(options, object, side, held.set);
  if (stopped) {
    Note(common,
         fmt::format("warning: interrupted: {} of the {} requested grasps were found and are in {}",
                     held.set.grasps.size(), options.count, options.output));
    return kInterrupted;
  }
  if (held.set.status == GraspStatus::kFound) return kDone;
  Note(common, fmt::format("warning: only {} of the {} requested grasps were found. For more, "
                           "allow grasps closer together (--apart, --apart-angle)",
                           held.set.grasps.size(), options.count));
  return kFitFault;
}

int Run(GraspCommand options) {
  const CommonOptions& common = options.common;
  const GraspFiles files = NewGraspFiles(options);
  const std::shared_ptr<const BodyModel> body = LoadBody(options.body);
  const Side side = HandFor(options.job.hands, *body);
  const LoadedObject object = LoadGraspable(options, false);
  PrepareSearch(object, options);
  StandingGrasp held;
  {
    Progress progress(common, "grasp");
    held = GraspStanding(body, side, object, options.job.search, [&](double share) {
      progress.Update(static_cast<int>(100 * share), 100);
      return !Interrupted();
    });
  }
  if (Interrupted()) return kInterrupted;
  RequireFound(held.report, object, options.job.search);
  WriteGrasp(object, files, held.clip);
  PrintGrasp(options, files, object, side, held.grasp, held.report);
  return kDone;
}

// Returns the one-frame start clip for both hands; `person` becomes its body.
Clip StartForBoth(const GraspCommand& options, ClipBody& person) {
  if (options.clip.empty()) return StandWithForearmsForward(person);
  LoadedClip loaded = LoadClip(options.clip, std::move(person.model), options.common);
  const Clip clip = std::move(loaded.clip);
  person = std::move(loaded.body);
  if (options.frame >= clip.NumFrames()) {
    throw Error(options.clip,
                fmt::format("has {} frames, but no frame {}", clip.NumFrames(), options.frame),
                "Give --frame within the clip, counted from 0");
  }
  return Slice(clip, options.frame, options.frame + 1);
}

void PrintBothHandsGrasp(const GraspCommand& options, const GraspFiles& files,
                         const LoadedObject& object, const BothHandsGrasp& grasp, bool has_place) {
  nlohmann::json summary =
      GraspSummaryHead("holdfast/grasp_both/1", options.common, files, object, "both");
  summary["width_mm"] = 1000.0 * grasp.width_m;
  summary["upright_cosine"] = grasp.upright;
  summary["body_in_object_mm"] = grasp.in_body_mm;
  if (has_place) {
    summary["place"] = GraspPlaceJson(options.place);
    summary["place"]["contacts_outside_ratio"] =
        std::max(grasp.hands[0].outside_place, grasp.hands[1].outside_place);
  }
  std::string text = fmt::format("{}: {} between both hands, {:.0f} mm apart\n",
                                 files.clip.string(), object.name, 1000.0 * grasp.width_m);
  for (int h = 0; h < 2; ++h) {
    const char* name = h == 0 ? "right" : "left";
    summary[name] = GraspJson(grasp.hands[h]);
    summary[name].erase("style");
    summary[name].erase("fingers_through_handle");
    summary[name]["wrist_shift_mm"] = grasp.wrist_shift_mm[h];
    summary[name]["wrist_turn_deg"] = grasp.wrist_turn_deg[h];
    text += fmt::format(
        "  {}: {} touch, {:.2f} mm deepest penetration, wrist moved {:.0f} mm and {:.0f} degrees\n",
        name, TouchingText(grasp.hands[h]), Deepest_mm(grasp.hands[h]), grasp.wrist_shift_mm[h],
        grasp.wrist_turn_deg[h]);
  }
  PrintResult(options.common, summary, text);
}

// Grasps an object between both hands: of a person who stands with forearms forward, or of a frame.
int RunBoth(const GraspCommand& options) {
  const CommonOptions& common = options.common;
  const GraspFiles files = NewGraspFiles(options);
  ClipBody person{LoadBody(options.body), {}};
  RequireHands(*person.model, kHoldsRight | kHoldsLeft);
  const LoadedObject object = LoadGraspable(options, true);

  Clip clip = StartForBoth(options, person);
  BothHandsOptions both_options;
  both_options.seed = common.seed;
  both_options.threads = NumThreads(common);
  const auto place = WantedPlace(options.place, options.object, options.job.object_scale);
  const BothHandsGrasp grasp = HoldStanding(person, object, place, both_options, clip);
  if (Interrupted()) return kInterrupted;
  WriteGrasp(object, files, clip);
  PrintBothHandsGrasp(options, files, object, grasp, place.has_value());
  return kDone;
}

}  // namespace

void AddGraspCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<GraspCommand>();
  CLI::App* command = app.add_subcommand(
      "grasp",
      "Close a hand around an object; writes a one-frame clip that fit accepts as --first-grasp");
  command->add_option("object", options->object, kObjectHelp)->required();
  command
      ->add_option("-o,--output", options->output,
                   "Clip to write (.npz); the mesh goes beside it. With --count: a folder")
      ->required();
  AddOptions(*command, OptionsOf(options->job));
  CLI::Option* const clip = command->add_option(
      "--clip", options->clip,
      "With --hand both: clip to take the body pose from; default: a standing person");
  AddOption(*command, "--frame", options->frame, "Frame of --clip, from 0")
      ->needs(clip)
      ->check(CLI::NonNegativeNumber);
  command->add_option(
      "--body", options->body,
      "Body model: SMPL-X, SMPL-H, or MANO for a hand alone (.npz, .pkl); default: the "
      "embedded one");
  AddGraspPlaceOptions(*command, options->place);
  CLI::Option* const count =
      command
          ->add_option(
              "--count", options->count,
              "Write this many distinct grasps to the folder -o instead. Each touches the object, "
              "penetrates it by at most 1 mm and holds its weight in any direction with friction "
              "0.5. If fewer are found, they are written with a warning and exit code 3")
          ->check(CLI::Range(1, 1'000'000));
  for (const char* of_many : {"--apart", "--apart-angle"}) {
    command->get_option(of_many)->needs(count);
  }
  AddCommonOptions(*command, options->common, true,
                   "  holdfast grasp mug -o mug_grasp.npz\n"
                   "  holdfast grasp hammer.obj -o hammer.npz --hand left --seed 3 --json\n"
                   "  holdfast grasp mug -o rim.npz --use vessel\n"
                   "  holdfast grasp bottle -o neck.npz --at 0,0,0.18\n"
                   "  holdfast grasp mug --count 50 -o mug_grasps\n"
                   "  holdfast grasp box.obj -o box.npz --hand both --clip carry.npz --frame 60\n");
  command->callback([options, &exit_code] {
    if (options->count > 0 && options->job.hands == GraspHands::kBoth) {
      throw CLI::ValidationError("--count", "is only for one hand");
    }
    if (options->job.hands == GraspHands::kBoth) {
      exit_code = RunBoth(*options);
      return;
    }
    if (!options->clip.empty()) throw CLI::ValidationError("--clip", "needs --hand both");
    exit_code = options->count > 0 ? RunMany(*options) : Run(*options);
  });
}

}  // namespace holdfast::apps
