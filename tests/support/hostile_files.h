// SPDX-License-Identifier: MIT
#pragma once

#include <sys/stat.h>
#include <unistd.h>

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <map>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "geometry/body/skeleton.h"
#include "geometry/clip/clip.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/container/npz.h"
#include "tests/support/synthetic_body.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/zip_bytes.h"

namespace holdfast::testing {

/// A file that is not what a command needs.
struct HostileFile {
  std::string name;       ///< within the folder
  bool may_pass = false;  ///< odd, but not wrong: a command may make something of it
};

/// Files that are nothing, never end, lie about themselves, or hold what no body or object does.
/// Made once, by code; the names tell what is wrong with each.
class HostileFolder {
 public:
  HostileFolder() {
    AddClips();
    AddMeshes();
    AddModels();
    AddMotions();
    AddLists();
    AddJson();
    AddData();
    AddFolders();
  }

  const std::filesystem::path& Path() const { return folder_.Path(); }

  /// Of any kind of file, with this ending: nothing there, a folder, a pipe, a device, ...
  std::vector<HostileFile> Any(const std::string& ending) {
    std::vector<HostileFile>& files = any_[ending];
    if (!files.empty()) return files;
    const auto name = [&](const std::string& stem) { return stem + ending; };
    const auto add = [&](const std::string& stem) { files.push_back({name(stem)}); };
    add("missing");
    add("not/a/folder/missing");
    add(std::string(300, 'n'));
    Write(name("empty"), "");
    add("empty");
    std::filesystem::create_directory(folder_ / name("folder"));
    add("folder");
    ::mkfifo((folder_ / name("pipe")).c_str(), 0600);
    add("pipe");
    std::filesystem::create_symlink(name("loop"), folder_ / name("loop"));
    add("loop");
    std::filesystem::create_symlink("nowhere", folder_ / name("dangling"));
    add("dangling");
    std::filesystem::create_symlink("/dev/zero", folder_ / name("device"));
    add("device");
    Write(name("beyond_a_file") + "_", "x");
    files.push_back({name("beyond_a_file") + "_/" + name("inside")});
    Write(name("zeros"), std::string(100'000, '\0'));
    add("zeros");
    std::mt19937 engine(7);
    std::string noise(5000, '\0');
    for (char& c : noise) c = static_cast<char>(engine());
    Write(name("noise"), noise);
    add("noise");
    Write(name("picture"), "\x89PNG\r\n\x1a\n" + noise);
    add("picture");
    Write(name("page"), "<!DOCTYPE html><html><body>log in</body></html>\n");
    add("page");
    Write(name("deep"), std::string(100'000, '['));
    add("deep");
    Write(name("bomb"), bomb_);
    add("bomb");
    Write(name("archive"), ZipBytes({{.name = "a.txt", .content = "hello"}}));
    add("archive");
    if (::geteuid() != 0) {  // root may read everything
      Write(name("locked"), "x");
      ::chmod((folder_ / name("locked")).c_str(), 0);
      add("locked");
    }
    return files;
  }

  const std::vector<HostileFile>& Clips() const { return clips_; }
  const std::vector<HostileFile>& Meshes() const { return meshes_; }
  const std::vector<HostileFile>& Models() const { return models_; }
  const std::vector<HostileFile>& Motions() const { return motions_; }
  const std::vector<HostileFile>& Lists() const { return lists_; }
  const std::vector<HostileFile>& Maps() const { return maps_; }
  const std::vector<HostileFile>& Data() const { return data_; }
  /// Result folders whose clip is sound: their metrics.json or their object is not.
  const std::vector<HostileFile>& Results() const { return results_; }
  /// Folders of work that was begun, whose manifest.json is not what it was.
  const std::vector<HostileFile>& Begun() const { return begun_; }

 private:
  void Write(const std::string& name, const std::string& content) {
    std::ofstream(folder_ / name, std::ios::binary) << content;
  }

  static NpzWriter ClipMembers(std::size_t frames = 3) {
    NpzWriter writer;
    const auto add = [&](const char* key, std::size_t columns, double value) {
      writer.AddFloat64(key, {frames, columns}, std::vector<double>(frames * columns, value));
    };
    writer.AddFloat64("mocap_frame_rate", {}, {30.0});
    add("trans", 3, 1.0);
    add("root_orient", 3, 0.1);
    add("pose_body", 63, 0.0);
    add("pose_hand", 90, 0.0);
    add("object_trans", 3, 1.0);
    add("object_orient", 3, 0.0);
    writer.AddText("object_name", "cube");
    writer.AddText("object_mesh", "");
    return writer;
  }

  using Change = std::function<void(NpzWriter&)>;

  static Change Doubles(const char* key, std::vector<std::size_t> shape,
                        std::vector<double> values) {
    return [=](NpzWriter& w) { w.AddFloat64(key, shape, values); };
  }

  // `value` amid harmless numbers.
  static Change Filled(const char* key, std::vector<std::size_t> shape, double value = 0.1) {
    std::size_t count = 1;
    for (const std::size_t n : shape) count *= n;
    std::vector<double> values(count, 0.1);
    values[count / 2] = value;
    return Doubles(key, shape, values);
  }

  void AddClip(const std::string& stem, const Change& change, bool may_pass = false,
               std::size_t frames = 3) {
    NpzWriter writer = ClipMembers(frames);
    change(writer);
    writer.Write(folder_ / (stem + ".npz"));
    clips_.push_back({stem + ".npz", may_pass});
  }

  void AddClips() {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    for (const auto& [key, columns] : {std::pair{"trans", 3U},
                                       {"root_orient", 3U},
                                       {"pose_body", 63U},
                                       {"pose_hand", 90U},
                                       {"object_trans", 3U},
                                       {"object_orient", 3U}}) {
      // Just within the ranges: nobody does that, but it is not refused.
      const double edge = std::string_view(key).ends_with("trans") ? -1e5 : 1e3;
      for (const auto& [prefix, value] : {std::pair{"nan_", double(NAN)},
                                          {"infinite_", kInfinity},
                                          {"1e300_", 1e300},
                                          {"1e30_", -1e30},
                                          {"edge_", edge}}) {
        AddClip(std::string(prefix) + key, Filled(key, {3, columns}, value), value == edge);
      }
    }
    for (const double rate : {0.0, -30.0, 1e-9, 1e-300, 1e300, kInfinity, double(NAN)}) {
      AddClip("rate_" + std::to_string(clips_.size()), Doubles("mocap_frame_rate", {}, {rate}));
    }
    for (const double rate : {1.0, 1e4}) {
      AddClip("edge_rate_" + std::to_string(clips_.size()), Doubles("mocap_frame_rate", {}, {rate}),
              true);
    }
    AddClip("edge_betas", Doubles("betas", {2}, {1e3, -1e3}), true);
    AddClip("rate_of_two", Doubles("mocap_frame_rate", {2}, {30, 30}));
    AddClip("betas_1e300", Doubles("betas", {2}, {1e300, 0}));
    AddClip("betas_nan", Doubles("betas", {2}, {0, NAN}));
    AddClip("text_for_trans", [](NpzWriter& w) { w.AddText("trans", "hello"); });
    AddClip("objects_for_trans", [](NpzWriter& w) {
      w.Add("trans", NpyArray{'O', 8, false, false, {3, 3}, std::vector<std::byte>(72)});
    });
    AddClip("complex_trans", [](NpzWriter& w) {
      w.Add("trans", NpyArray{'c', 16, false, false, {3, 3}, std::vector<std::byte>(144)});
    });
    AddClip("wide_pose", Filled("pose_body", {3, 66}));
    AddClip("scalar_trans", Doubles("trans", {}, {1.0}));
    AddClip("unequal", Filled("pose_body", {4, 63}));
    AddClip("object_of_other_length", Filled("object_trans", {2, 3}));
    AddClip(
        "no_frames", [](NpzWriter&) {}, false, 0);
    AddClip("nine_hands", [](NpzWriter& w) { w.AddUint8("holding_hand", {3}, {1, 9, 0}); });
    AddClip("huge_template", Filled("v_template", {2, 3}, 1e300));
    AddClip("labels_of_300", [](NpzWriter& w) {
      w.AddInt64("contact_object", {3, 1}, {0, 300, 0});
    });
    const std::string npy("\x93NUMPY\x01\x00v\x00", 10);
    const auto member = [&](std::string header) {
      header.resize(118, ' ');
      header.back() = '\n';
      return npy + header;
    };
    Raw("shape_of_1e18.npz",
        ZipBytes({{.name = "trans.npy",
                   .content = member("{'descr': '<f8', 'fortran_order': False, 'shape': "
                                     "(1000000000, 1000000000), }")},
                  {.name = "root_orient.npy", .content = ""},
                  {.name = "pose_body.npy", .content = ""},
                  {.name = "mocap_frame_rate.npy",
                   .content = member("{'descr': '<f8', 'fortran_order': False, 'shape': (), }") +
                              std::string("\0\0\0\0\0\0\x3e\x40", 8)}}),
        clips_);
    ClipMembers().Write(folder_ / "whole.npz");
    const std::string bytes = ReadFile(folder_ / "whole.npz");
    Raw("half.npz", bytes.substr(0, bytes.size() / 2), clips_);
    Raw("without_end.npz", bytes.substr(0, bytes.size() - 10), clips_);
    std::string damaged = bytes;
    for (std::size_t i = 60; i < damaged.size() / 2; i += 97) damaged[i] ^= 0x55;
    Raw("damaged.npz", damaged, clips_);
    Raw("bomb_inside.npz",
        ZipBytes({{.name = "trans.npy",
                   .content = member("{'descr': '|u1', 'fortran_order': False, 'shape': "
                                     "(80000000, 3), }") +
                              std::string(80'000'000, '\0'),
                   .method = 8}}),
        clips_);
  }

  void Raw(const std::string& name, const std::string& content, std::vector<HostileFile>& list,
           bool may_pass = false) {
    Write(name, content);
    list.push_back({name, may_pass});
  }

  void AddMeshes() {
    const auto obj = [&](const std::string& stem, const std::string& text, bool may_pass = false) {
      Raw(stem + ".obj", text, meshes_, may_pass);
    };
    const std::string corners = "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\n";
    const std::string sides = "f 1 3 2\nf 1 4 3\nf 1 2 4\nf 2 3 4\n";
    for (const char* number :
         {"nan", "inf", "1e300", "1e39", "1e30", "1e6", "-1e10", "0x10", "1,5"}) {
      obj(std::string("number_") + number,
          corners + "v " + number + " 0 0\n" + sides + "f 1 2 5\n");
    }
    obj("edge", corners + "v 1e5 0 0\n" + sides + "f 1 2 5\n", true);
    obj("id_9", corners + "f 1 2 9\n");
    obj("id_0", corners + "f 0 1 2\n");
    obj("id_minus_9", corners + "f -9 1 2\n");
    obj("id_1e20", corners + "f 1 2 100000000000000000000\n");
    obj("two_corners", corners + "f 1 2\n");
    obj("points", corners);
    obj("faces_only", "f 1 2 3\n");
    obj("line", "v 0 0 0\nv 0.1 0 0\nv 0.2 0 0\nf 1 2 3\n");
    obj("one_place", "v 0 0 0\nv 0 0 0\nv 0 0 0\nf 1 2 3\n");
    obj("eighty_meters", "v 0 0 0\nv 80 0 0\nv 0 80 0\nv 0 0 80\n" + sides, true);
    obj("a_micrometer", "v 0 0 0\nv 1e-6 0 0\nv 0 1e-6 0\nv 0 0 1e-6\n" + sides, true);
    obj("one_triangle", corners + "f 1 2 3\n", true);
    obj("polygon_100k", Disc(100'000, true), true);
    obj("fan_100k", Disc(100'000, false), true);
    const std::string head = "ply\nformat ascii 1.0\n";
    const std::string xyz = "property float x\nproperty float y\nproperty float z\n";
    const std::string list = "property list uchar int vertex_indices\nend_header\n";
    const auto ply = [&](const std::string& stem, const std::string& text) {
      Raw(stem + ".ply", head + text, meshes_);
    };
    ply("vertices_4e9",
        "element vertex 4000000000\n" + xyz + "element face 1\n" + list + "0 0 0\n");
    ply("vertices_minus", "element vertex -3\n" + xyz + "element face 1\n" + list + "0 0 0\n");
    ply("faces_4e9", "element vertex 1\n" + xyz + "element face 4000000000\n" + list + "0 0 0\n");
    ply("corners_200", "element vertex 1\n" + xyz + "element face 1\n" + list + "0 0 0\n200 0 0\n");
    ply("no_end", "element vertex 3\n" + xyz);
    ply("nan", "element vertex 3\n" + xyz + "element face 1\n" + list +
                   "0 0 0\nnan 0 0\n0 1 0\n3 0 1 2\n");
    ply("no_faces", "element vertex 1\n" + xyz + "end_header\n0 0 0\n");
    Raw("counts.off", "OFF\n1000000000 1000000000 0\n0 0 0\n", meshes_);
    Raw("nan.off", "OFF\n3 1 0\n0 0 0\nnan 0 0\n0 1 0\n3 0 1 2\n", meshes_);
    Raw("binary.off", "OFF BINARY\n1234", meshes_);
    Raw("count.stl", std::string(80, ' ') + "\xff\xff\xff\xff" + std::string(50, '\0'), meshes_);
    Raw("open.stl", "solid x\nfacet normal 0 0 0\nouter loop\nvertex 0 0 0\n", meshes_);
    Raw("nan.stl",
        "solid x\nfacet normal 0 0 0\nouter loop\nvertex nan 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
        "endloop\nendfacet\nendsolid\n",
        meshes_);
    Raw("mesh.fbx", "Kaydara FBX Binary", meshes_);
    Raw("mesh", corners + sides, meshes_);
  }

  // A disc as one polygon or as triangles around its middle.
  static std::string Disc(int corners, bool polygon) {
    std::string text = polygon ? "" : "v 0 0 0\n";
    for (int i = 0; i < corners; ++i) {
      const double angle = 2.0 * std::numbers::pi * i / corners;
      text += "v " + std::to_string(0.05 * std::cos(angle)) + " " +
              std::to_string(0.05 * std::sin(angle)) + " " +
              std::to_string(0.01 * std::sin(9 * angle)) + "\n";
    }
    if (polygon) text += "f";
    for (int i = 0; i < corners; ++i) {
      text += polygon ? " " + std::to_string(i + 1)
                      : "f 1 " + std::to_string(i + 2) + " " +
                            std::to_string((i + 1) % corners + 2) + "\n";
    }
    return text + "\n";
  }

  void AddModels() {
    const SyntheticBody body(60);
    body.Write(folder_ / "sound_model.npz");
    const auto model = [&](const std::string& stem, const Change& change) {
      body.Write(folder_ / (stem + "_model.npz"), {}, change);
      models_.push_back({stem + "_model.npz"});
    };
    model("nan", Filled("v_template", {60, 3}, NAN));
    model("1e300", Filled("v_template", {60, 3}, 1e300));
    model("1e30_shapes", Filled("shapedirs", {60, 3, 20}, 1e30));
    model("nan_poses", Filled("posedirs", {60, 3, 486}, NAN));
    model("1e300_weights", Filled("weights", {60, 55}, 1e300));
    model("1e300_joints", Filled("J_regressor", {55, 60}, 1e300));
    model("1e300_hands", Filled("hands_meanl", {45}, 1e300));
    model("narrow_weights", Filled("weights", {60, 24}, 0.1));
    model("short_template", Filled("v_template", {30, 3}, 0.1));
    model("half_corners", Filled("f", {1, 3}, 1.5));
    model("far_corners", Filled("f", {1, 3}, 1e6));
    model("no_vertices", Doubles("v_template", {0, 3}, {}));
    model("own_parents", [](NpzWriter& w) {
      std::vector<std::int64_t> tree(2 * kNumJoints);
      for (int j = 0; j < 2 * kNumJoints; ++j) tree[static_cast<std::size_t>(j)] = j % kNumJoints;
      w.AddInt64("kintree_table", {2, kNumJoints}, tree);
    });
    models_.push_back({"whole.npz"});  // a clip
    Raw("system.pkl", "cos\nsystem\n(S'true'\ntR.", models_);
    Raw("endless.pkl", "\x80\x02" + std::string(50'000, '('), models_);
    Raw("huge_text.pkl", std::string("\x80\x04\x8d\xff\xff\xff\xff\xff\xff\xff\x7f", 11), models_);
  }

  static std::string Bvh(const std::string& offset, const std::string& frames,
                         const std::string& time, const std::string& number) {
    std::string text =
        "HIERARCHY\nROOT Hips\n{\n OFFSET 0 0 0\n CHANNELS 6 Xposition Yposition "
        "Zposition Zrotation Xrotation Yrotation\n";
    const auto joint = [&](const std::string& name, const std::string& inside) {
      return " JOINT " + name + "\n {\n OFFSET " + offset +
             " 0 0\n CHANNELS 3 Zrotation Xrotation Yrotation\n" + inside + " }\n";
    };
    const std::string end = " End Site\n {\n OFFSET 0 -5 0\n }\n";
    text += joint("LeftUpLeg", joint("LeftLeg", joint("LeftFoot", end)));
    text += joint("RightUpLeg", joint("RightLeg", joint("RightFoot", end)));
    text += joint("Spine", joint("Neck", joint("Head", end)));
    text += "}\nMOTION\nFrames: " + frames + "\nFrame Time: " + time + "\n";
    for (int i = 0; i < 33; ++i) text += (i == 7 ? number : "0") + " ";
    return text + "\n";
  }

  void AddMotions() {
    const auto bvh = [&](const std::string& stem, const std::string& text) {
      Raw(stem + ".bvh", text, motions_);
    };
    Write("whole.bvh", Bvh("10", "1", "0.033", "0"));
    for (const std::string offset : {"1e300", "nan", "1e30"}) {
      bvh("offset_" + offset, Bvh(offset, "1", "0.033", "0"));
    }
    for (const std::string angle : {"nan", "inf", "text"}) {
      bvh("angle_" + angle, Bvh("10", "1", "0.033", angle));
    }
    for (const std::string time : {"1e9", "1e-9", "0", "-0.03", "nan"}) {
      bvh("time_" + time, Bvh("10", "1", time, "0"));
    }
    for (const std::string frames : {"1000000000", "-1", "0"}) {
      bvh("frames_" + frames, Bvh("10", frames, "0.033", "0"));
    }
    bvh("no_motion", "HIERARCHY\nROOT Hips\n{\n OFFSET 0 0 0\n}\n");
    bvh("open", "HIERARCHY\nROOT Hips\n{\n OFFSET 0 0");
    std::string deep =
        "HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\n";
    for (int i = 0; i < 50'000; ++i) deep += "JOINT a\n{\nOFFSET 0 1 0\n";
    bvh("deep_joints", deep);
    Raw("alone.amc", ":FULLY-SPECIFIED\n:DEGREES\n1\nroot 0 0 0 0 0 0\n", motions_);
    Raw("bad.amc", ":FULLY-SPECIFIED\n:DEGREES\nroot\n", motions_);
    const auto gltf = [&](const std::string& stem, const std::string& text) {
      Raw(stem + ".gltf", R"({"asset":{"version":"2.0"},)" + text + "}", motions_);
    };
    gltf("nothing", R"("nodes":[])");
    gltf("own_child",
         R"("nodes":[{"children":[0]}],"scenes":[{"nodes":[0]}],"skins":[{"joints":[0]}])");
    gltf("far_child", R"("nodes":[{"children":[7]}],"scenes":[{"nodes":[0]}])");
    gltf("outside", R"("buffers":[{"uri":"../../etc/passwd","byteLength":9}],"nodes":[{}])");
    gltf("of_a_pipe", R"("buffers":[{"uri":"pipe.glb","byteLength":9}],"nodes":[{}])");
    gltf("huge_buffer", R"("buffers":[{"byteLength":1e18}],"nodes":[{}])");
    gltf("wrong_types", R"("nodes":5,"skins":{"joints":"x"},"animations":[3])");
    Raw("length.glb", std::string("glTF\x02\0\0\0\xff\xff\xff\x7f\xff\xff\xff\x7fJSON{}", 22),
        motions_);
  }

  void AddLists() {
    const auto list = [&](const std::string& stem, const std::string& text) {
      Raw(stem + ".list", text, lists_);
    };
    list("one_word", "demo_drink\n");
    list("open_quote", "demo_drink \"cube\n");
    list("unknown_key", "demo_drink cube speed=9\n");
    list("third_hand", "demo_drink cube hand=third\n");
    list("slash_name", "demo_drink cube name=../up\n");
    list("start_text", "demo_drink cube start=soon\n");
    list("start_huge", "demo_drink cube start=99999999999999999999\n");
    list("scale_nan", "demo_drink cube object-scale=nan\n");
    list("scale_1e300", "demo_drink cube object-scale=1e300\n");
    list("scale_minus", "demo_drink cube object-scale=-1\n");
    list("same_names", "demo_drink cube name=a\ndemo_drink cube name=a\n");
    list("long_word", std::string(300, 'n') + " cube\n");
    list("comments", "# nothing\n\n");
    list("20_megabytes", std::string(20'000'000, '#'));
  }

  void AddJson() {
    const auto map = [&](const std::string& stem, const std::string& text) {
      Raw(stem + ".json", text, maps_);
    };
    map("list", "[1, 2, 3]");
    map("number", "5");
    map("numbers_in_it", R"({"Hips": 5})");
    map("unknown_joint", R"({"Hips": "tail"})");
    map("open_brace", R"({"Hips": "pelvis")");
    map("nested", R"({"Hips": {"pelvis": ["x"]}})");
  }

  void AddData() {
    const auto data = [&](const std::string& name, const std::string& content) {
      Raw(name, content, data_);
    };
    data("huge.npy",
         std::string("\x93NUMPY\x01\x00v\x00", 10) +
             "{'descr': '<f8', 'fortran_order': False, 'shape': (100000000000, 165), }" +
             std::string(45, ' ') + "\n");
    data("header.npy", std::string("\x93NUMPY\x01\x00\xff\xff", 10));
    data("python.npy", std::string("\x93NUMPY\x01\x00v\x00", 10) +
                           "{'descr': __import__('os').system('true'), 'shape': (1,), }" +
                           std::string(58, ' ') + "\n");
    data("list_of_lists.json", std::string(90, '[') + std::string(90, ']'));
    data("wrong_types.json", R"({"global_orient": "x", "body_pose": {"a": 1}, "transl": null})");
    data("nan_pose.json", R"({"global_orient": [[0, 0, 1e999]], "body_pose": [[0]]})");
    data("tensor.safetensors",
         LittleEndian(70, 8) +
             R"({"a":{"dtype":"F64","shape":[9,9],"data_offsets":[0,99999999999]}}    )");
    data("header.safetensors", LittleEndian(std::uint64_t{1} << 62, 8) + "{}");
    data("torch.pt",
         ZipBytes({{.name = "archive/data.pkl", .content = "cos\nsystem\n(S'true'\ntR."}}));
    data("legacy.pt", std::string("\x80\x02\x8a\x0a\x6c\xfc\x9c\x46\xf9\x20\x6a\xa8\x50\x19.", 15));
  }

  void AddFolders() {
    Write("good.list", "demo_drink cube\n");
    const auto add = [&](const std::string& name, const std::string& file, bool may_pass,
                         const std::function<void(const std::filesystem::path&)>& make,
                         std::vector<HostileFile>& list) {
      std::filesystem::create_directory(folder_ / name);
      if (&list == &results_) {
        NpzWriter clip = ClipMembers();
        clip.AddText("object_mesh", "object.ply");
        clip.Write(folder_ / name / "clip.npz");
      }
      make(folder_ / name / file);
      list.push_back({name, may_pass});
    };
    const std::map<std::string, std::string> texts = {
        {"empty", ""},
        {"open", "{"},
        {"list", "[1]"},
        {"number", "5"},
        {"deep", std::string(100'000, '[')},
        {"schema_5", R"({"schema": 5, "question": 5, "summary": 5, "options": [], "notes": 5})"},
        {"fits", R"({"schema": "holdfast/fit-batch/1", "jobs_asked": 5, "seed": "x"})"},
        {"per_frame", R"({"per_frame": {"a": [1, "x", null]}, "options": {"body": 5}})"},
        {"reaches", R"({"schema": "holdfast/reach-data/1", "options": 5, "clips": [5]})"},
        {"actions", R"({"schema": "holdfast/actions/1", "clips": {"a": 5}})"}};
    const auto pipe = [](const std::filesystem::path& path) { ::mkfifo(path.c_str(), 0600); };
    const auto device = [](const std::filesystem::path& path) {
      std::filesystem::create_symlink("/dev/zero", path);
    };
    const auto loop = [](const std::filesystem::path& path) {
      std::filesystem::create_symlink(path.filename(), path);
    };
    for (auto* list : {&results_, &begun_}) {
      const bool result = list == &results_;
      const std::string prefix = result ? "result_" : "begun_";
      const std::string file = result ? "metrics.json" : "manifest.json";
      for (const auto& [name, text] : texts) {
        add(
            prefix + name, file, result,
            [&](const std::filesystem::path& path) { std::ofstream(path) << text; }, *list);
      }
      add(prefix + "pipe", file, result, pipe, *list);
      add(prefix + "device", file, result, device, *list);
      add(prefix + "loop", file, result, loop, *list);
    }
    add("object_pipe", "object.ply", true, pipe, results_);
    add("object_device", "object.ply", true, device, results_);
    add("object_loop", "object.ply", true, loop, results_);
    add(
        "clip_pipe", "unused", false,
        [&](const std::filesystem::path& path) {
          std::filesystem::remove(path.parent_path() / "clip.npz");
          ::mkfifo((path.parent_path() / "clip.npz").c_str(), 0600);
        },
        results_);
  }

  TemporaryFolder folder_;
  const std::string bomb_ = Gzipped(std::string(std::size_t{64} << 20, ' '));
  std::map<std::string, std::vector<HostileFile>> any_;
  std::vector<HostileFile> clips_, meshes_, models_, motions_, lists_, maps_, data_, results_,
      begun_;
};

}  // namespace holdfast::testing
