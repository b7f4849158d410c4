// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "generator/imos/recognition.h"
#include "generator/imos/weights.h"
#include "geometry/body/default_hand.h"
#include "geometry/body/skeleton.h"
#include "geometry/clip/clip.h"
#include "geometry/clip/clip_arrays.h"
#include "geometry/embedded.h"
#include "geometry/io/container/npz.h"
#include "geometry/io/container/safetensors.h"
#include "geometry/io/mesh/mesh_io.h"
#include "solver/actions/action_clip.h"
#include "solver/markers/keypoint_hand.h"
#include "solver/markers/marked_person.h"
#include "tests/generator/test_body.h"
#include "tests/support/action_scene.h"
#include "tests/support/data_folder.h"
#include "tests/support/npy.h"
#include "tests/support/program.h"
#include "tests/support/robot_files.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/walking_figure.h"

namespace holdfast::testing {

/// The files that examples of the help, of the README and of docs/ speak of, made when first asked
/// for: by the program, or by the tests' own writers where a user has them from elsewhere.
class ExampleFiles {
 public:
  /// Thrown where a file comes from the folder with data, and it is not there.
  struct NoData {
    std::filesystem::path file;
  };

  /// Puts the file or folder that `word` of a command line names, or is in, into `folder` unless
  /// it is there. False where no such file is known.
  bool Place(const std::string& word, const std::filesystem::path& folder) {
    for (const auto& [name, maker] : makers_) {
      if (word != name && !word.starts_with(name + "/")) continue;
      if (!std::filesystem::exists(folder / name)) {
        std::filesystem::create_directories((folder / name).parent_path());
        std::filesystem::copy(Made(name), folder / name, kAll);
      }
      return true;
    }
    return false;
  }

  /// Where `line` is a command that one of the files is made by, it runs once for all who read the
  /// file: puts what it made into `folder`. False for any other line.
  bool PlaceResultOf(std::string line, const std::filesystem::path& folder) {
    line.resize(std::min(line.find(" #"), line.size()));
    line.resize(line.find_last_not_of(' ') + 1);
    for (const auto& [name, command] : commands_) {
      if (line != "holdfast " + command || std::filesystem::exists(folder / name)) continue;
      return Place(name, folder);
    }
    return false;
  }

 private:
  using Path = std::filesystem::path;
  static constexpr auto kAll =
      std::filesystem::copy_options::recursive | std::filesystem::copy_options::copy_symlinks;

  Path Made(const std::string& name) {
    const Path path = made_ / name;
    if (!std::filesystem::exists(path)) {
      std::filesystem::create_directories(path.parent_path());
      makers_.at(name)(path);
    }
    return path;
  }

  void Run(const std::string& arguments) {
    const ProgramResult result = RunHoldfast(made_.Path(), arguments);
    if (result.exit_code != 0) throw std::runtime_error(arguments + ": " + result.err);
  }

  // A relaxed hand in three frames, 21 points each.
  static void WriteKeypoints(const Path& path) {
    const HandModel model(DefaultHand(Side::kRight), {}, Side::kRight);
    const HandAxes axes(model);
    KeypointHand::Points points;
    KeypointHand(axes).Evaluate(axes.PoseOf(axes.Relaxed()), points, nullptr);
    std::vector<float> numbers;
    for (int t = 0; t < 3; ++t) {
      for (const double x : points.reshaped()) numbers.push_back(static_cast<float>(x));
    }
    WriteNpy(path, "(3, 21, 3)", numbers);
  }

  static std::function<void(const Path&)> Fixture(const std::string& name) {
    return [name](const Path& path) {
      std::filesystem::copy(Path(HOLDFAST_SOURCE_DIR) / "tests/fixtures" / name, path, kAll);
    };
  }

  static std::function<void(const Path&)> Text(const std::string& text) {
    return [text](const Path& path) { std::ofstream(path, std::ios::binary) << text; };
  }

  static std::function<void(const Path&)> Embedded(const std::string& name) {
    return [name](const Path& path) {
      const auto bytes = FindEmbedded(name).bytes;
      std::ofstream(path, std::ios::binary)
          .write(reinterpret_cast<const char*>(bytes.data()),
                 static_cast<std::streamsize>(bytes.size()));
    };
  }

  void RunFor(const std::string& name) { Run(commands_.at(name)); }

  // An embedded object as somebody else's mesh.
  static std::function<void(const Path&)> Mesh(const std::string& object, double scale = 1.0) {
    return [object, scale](const Path& path) {
      const EmbeddedFile file = FindEmbedded("objects/" + object + ".ply");
      TriangleMesh mesh =
          ReadMeshBytes({reinterpret_cast<const char*>(file.bytes.data()), file.bytes.size()},
                        file.name)
              .mesh;
      mesh.vertices *= scale;
      WriteMesh(mesh, path);
    };
  }

  // The embedded body as a SMPL-X file, with the hands' principal components that it has.
  static void WriteSmplxLike(const Path& path) {
    const NpzReader body(FindEmbedded("body/holdfast_neutral.npz").bytes, "body");
    NpzWriter writer;
    for (const std::string& name : body.Keys()) writer.Add(name, body.Read(name).array);
    std::vector<double> identity(45 * 45, 0.0);
    for (std::size_t i = 0; i < 45; ++i) identity[46 * i] = 1.0;
    for (const char* side : {"l", "r"}) {
      writer.AddFloat64(std::string("hands_mean") + side, {45}, std::vector<double>(45, 0.0));
      writer.AddFloat64(std::string("hands_components") + side, {45, 45}, identity);
    }
    writer.Write(path);
  }

  // What a tracker made of a clip: the object trembles by a millimeter.
  void WriteCaptured(const Path& path) {
    Clip clip = ReadClip(Made("held") / "clip.npz");
    for (Eigen::Index t = 0; t < clip.object->trans.cols(); ++t) {
      clip.object->trans(t % 3, t) += t % 2 == 0 ? 0.001 : -0.001;
    }
    WriteClip(clip, path);
  }

  static void WriteCaptures(const Path& folder) {
    std::filesystem::create_directories(folder);
    const BodyMeasures& body = DefaultMeasures();
    std::ofstream index(folder / "index.csv");
    index << "file,subject,category,fps,hand,key_frame\n";
    const auto add = [&](const std::string& subject, const std::string& category, const Clip& clip,
                         const std::string& mark = ",") {
      static int count = 0;
      const std::string file = fmt::format("{}_{}_{}.npz", subject, category, count++);
      WriteClip(clip, folder / file);
      index << fmt::format("{},{},{},30,{}\n", file, subject, category, mark);
    };
    for (const char* subject : {"cmu_07", "cmu_08", "cmu_39"}) {
      add(subject, "idle", StandingFigure(body, 120));
      add(subject, "walk", WalkingFigure(body, 240, 1.0));
      add(subject, "walk", WalkingFigure(body, 150, 0.95));
    }
    const Eigen::Vector3d pelvis = body.rest_joints.col(0);
    add("cmu_07", "reach", ReachingFigure(body, 121, 0.7), "right,60");
    add("cmu_07", "reach", ReachingFigure(body, 121, 1.2), "right,60");
    add("cmu_07", "reach", MirrorClip(ReachingFigure(body, 121, 0.7), pelvis), "left,60");
    add("cmu_07", "reach", MirrorClip(ReachingFigure(body, 121, 1.2), pelvis), "left,60");
  }

  // A capture of the CMU, where the folder with data has it.
  static std::function<void(const Path&)> Captured(const std::string& name) {
    return [name](const Path& path) {
      const Path file = DataFolder() / "mocap" / name;
      if (!std::filesystem::exists(file)) throw NoData{file};
      std::filesystem::copy(file, path);
    };
  }

  // Every joint of the body under its own name.
  // Someone who sits still with the forearms forward, all markers of the upper limbs, and a mug
  // with three.
  static void WriteMarkers(const Path& path) {
    std::vector<MarkerSite> sites;
    for (const MarkerSite& site : MarkerTable::Known().Sites()) {
      const std::string plain = site.name.substr(1);
      if (site.name == "STRN" || plain == "FTP" || plain == "FB" || plain == "THUM" ||
          (plain.size() == 4 && plain[3] >= '1' && plain[3] <= '4')) {
        sites.push_back(site);
      }
    }
    const MarkedPerson person = MakeMarkedPerson(BodyModel::Default(), sites, RestPosture::kSeated);
    std::string head = ",", axes = "Frame,Sub Frame", units = ",", row;
    for (std::size_t k = 0; k < sites.size(); ++k) {
      head += ",P1:" + sites[k].name + ",,";
      axes += ",X,Y,Z";
      units += ",mm,mm,mm";
      const double step = 10.0 * static_cast<double>(k % 4);
      const Eigen::Vector3d x = 1e3 * person.bent.col(static_cast<Eigen::Index>(k));
      row += fmt::format(",{:.2f},{:.2f},{:.2f}", x.x() + step, -x.z(), x.y() + step * step / 20.0);
    }
    const double mug[3][3] = {{40, 0, 20}, {-40, 0, 50}, {0, 45, 80}};  // as mug.csv has them
    const char* const of_mug[] = {"mug_a", "mug_b", "mug_c"};
    for (int k = 0; k < 3; ++k) {
      head += fmt::format(",P1:{},,", of_mug[k]);
      axes += ",X,Y,Z";
      units += ",mm,mm,mm";
      row += fmt::format(",{},{},{}", mug[k][0] + 200, mug[k][1] - 500, mug[k][2] + 100);
    }
    std::ofstream out(path);
    out << "Trajectories\n50\n" << head << '\n' << axes << '\n' << units << '\n';
    for (int t = 1; t <= 30; ++t) out << t << ",0" << row << '\n';
  }

  static void WriteRecordings(const Path& folder) {
    std::filesystem::create_directories(folder / "P1");
    WriteMarkers(folder / "P1" / "P1_static.csv");
    WriteMarkers(folder / "P1" / "P1_drinks.csv");
  }

  static void WriteMap(const Path& path) {
    nlohmann::json map;
    for (int j = 0; j < 22; ++j) map[std::string(kJointNames[j])] = kJointNames[j];
    std::ofstream(path) << map;
  }

  static void WriteActions(const Path& folder) {
    imos::testing::WriteComposedSet(folder, 3, {"s1", "s2", "s9", "s10"});
  }

  static std::function<void(const Path&)> Embeddings(std::size_t size) {
    return [size](const Path& path) {
      NpzWriter table;
      table.AddFloat32("embeddings", {imos::kNumActions, size},
                       std::vector<float>(imos::kNumActions * size, 0.5f));
      table.Write(path);
    };
  }

  TemporaryFolder made_;
  // What the program makes of them, as examples are shortened.
  const std::map<std::string, std::string> commands_ = {
      {"fits", "fit --batch list.txt -o fits"},
      {"held", "fit demo_drink mug --end 60 -o held"},
      {"held_bottle", "fit demo_drink bottle --end 60 -o held_bottle"}};
  // By name; a name in a folder of the table comes before the folder.
  const std::map<std::string, std::function<void(const Path&)>, std::greater<>> makers_ = {
      {"hand.urdf", [](const Path& path) { BoxHand{}.Write(path); }},
      // Meshes.
      {"ball.obj", Mesh("sphere")},
      {"banana.obj", Mesh("banana")},
      {"bottle.obj", Mesh("bottle")},
      {"box.obj", Mesh("cube", 3.0)},
      {"hammer.obj", Mesh("hammer")},
      {"jug.obj", Mesh("teapot")},
      {"mug.obj", Mesh("mug")},
      // Body models.
      {"MANO_RIGHT.pkl", Fixture("body_models/MANO_RIGHT.pkl")},
      {"SMPLH_MALE.pkl", Fixture("body_models/SMPLH_MALE.pkl")},
      {"SMPLX_NEUTRAL.npz", WriteSmplxLike},
      // Motion.
      {"07.asf.gz", Captured("cmu_asfamc/07.asf.gz")},
      {"07_03.amc.gz", Captured("cmu_asfamc/07_03.amc.gz")},
      {"GRAB", Fixture("parameters/grab")},
      {"captured.npz", [this](const Path& path) { WriteCaptured(path); }},
      {"carry.npz", [this](const Path&) { Run("export demo_pass -o carry.npz"); }},
      {"character.glb", Fixture("gltf/mixamo.glb")},
      {"dance.bvh",
       [this](const Path&) {
         Made("walk.npz");
         Run("export walk.npz -o dance.bvh");
       }},
      {"drink.csv", WriteMarkers},
      {"static.csv", WriteMarkers},
      {"mug.csv", Text("name,x,y,z\nmug_a,0.04,0,0.02\nmug_b,-0.04,0,0.05\nmug_c,0,0.045,0.08\n")},
      {"names.csv", Text("name,joint,vertex,cluster\nSTRN,spine3,,\nRSHO1,right_collar,,r\n"
                         "RSHO2,right_collar,,r\nLSHO1,left_collar,,l\nLSHO2,left_collar,,l\n")},
      {"goals.csv",
       [](const Path& path) {
         std::ofstream file(path);
         for (int t = 0; t < 100; ++t) file << fmt::format("{:.3f},-0.6,1.1\n", 0.01 * t);
       }},
      {"recordings", WriteRecordings},
      {"solved",
       [this](const Path&) {
         Made("drink.csv");
         Run(fmt::format("solve {} -o solved", (made_.Path() / "drink.csv").string()));
       }},
      {"map.json", WriteMap},
      {"keypoints.npy", WriteKeypoints},
      {"estimated.npz",
       [](const Path& path) { WriteClip(WalkingFigure(DefaultMeasures(), 90, 1.0), path); }},
      {"hmr4d_results.pt", Fixture("hand_sets/gvhmr.pkl")},
      {"pass.npz", [this](const Path&) { Run("export demo_pass -o pass.npz"); }},
      {"smplifyx/results", Fixture("parameters/smplifyx")},
      {"visualize_samples/s10_mug_drink_1_0.npz", Fixture("torch/s10_mug_drink_1.npz")},
      {"walk.bvh",
       [this](const Path&) {
         Made("walk.npz");
         Run("export walk.npz -o walk.bvh");
       }},
      {"walk.npz",
       [](const Path& path) { WriteClip(WalkingFigure(DefaultMeasures(), 240, 1.0), path); }},
      {"evil.pkl",  // pickle.dumps of what __reduce__s to os.system("echo evil")
       Text("\x80\x04\x95\x24" + std::string(7, '\0') +
            "\x8c\x05posix\x94\x8c\x06system\x94\x93\x94\x8c\x09"
            "echo evil\x94\x85\x94R\x94.")},
      // Results and lists.
      {"fits",
       [this](const Path&) {
         Made("list.txt");
         RunFor("fits");
       }},
      {"held", [this](const Path&) { RunFor("held"); }},
      {"held_bottle", [this](const Path&) { RunFor("held_bottle"); }},
      {"list.txt", Text("demo_drink mug end=12\ndemo_inspect apple hand=right end=12\n")},
      // Sets and networks.
      {"actions", WriteActions},
      {"clip_embeddings.npz", Embeddings(512)},
      {"clip_embeddings_8.npz", Embeddings(8)},
      {"grab_clips", WriteActions},
      {"mocap", WriteCaptures},
      {"out/imos/best.safetensors", Embedded("networks/imos.safetensors")},
      {"out/wandr/best.safetensors", Embedded("networks/wandr.safetensors")},
      {"reaches",
       [this](const Path&) {
         Made("mocap");
         Run("make-reach-data mocap -o reaches --hours 0.02 --held-out cmu_08,cmu_39");
       }},
      {"recognizer.safetensors",
       [](const Path& path) {
         SafetensorsWriter writer;
         for (const auto& [name, tensor] : imos::RandomRecognizer(1)) {
           writer.AddFloat32(name, tensor.shape, tensor.values);
         }
         writer.Write(path);
       }},
      {"arms.p", Fixture("imos/arms.p")},
      {"body.p", Fixture("imos/body.p")},
      {"exp_80_001600.p", Fixture("imos/arms.p")},
      {"exp_31_001500.p", Fixture("imos/body.p")},
      {"wandr.ckpt", Fixture("wandr/wandr.ckpt")},
      {"statistics.npy", Fixture("wandr/statistics.npy")},
  };
};

}  // namespace holdfast::testing
