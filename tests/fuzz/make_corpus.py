#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Writes the seeds of the fuzz targets under corpus/: small files as real programs write them.

  /usr/bin/python3 tests/fuzz/make_corpus.py [target...]

Needs numpy. Running it again gives the same files; what fuzzing found lies beside them under
names of hexadecimal digits and is left alone.
"""

import base64
import collections
import gzip
import io
import json
import pathlib
import pickle
import struct
import sys
import zipfile

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parent / "corpus"
BODY = ["pelvis", "left_hip", "right_hip", "spine1", "left_knee", "right_knee", "spine2",
        "left_ankle", "right_ankle", "spine3", "left_foot", "right_foot", "neck", "left_collar",
        "right_collar", "head", "left_shoulder", "right_shoulder", "left_elbow", "right_elbow",
        "left_wrist", "right_wrist"]


def put(target, name, content):
    if isinstance(content, str):
        content = content.encode()
    folder = ROOT / target
    folder.mkdir(parents=True, exist_ok=True)
    (folder / name).write_bytes(content)


def npy(array, version=None):
    out = io.BytesIO()
    np.lib.format.write_array(out, np.asanyarray(array), version=version)
    return out.getvalue()


def archive(members, method=zipfile.ZIP_STORED):
    """A zip with fixed times. members: name -> bytes."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", method) as zipped:
        for name, content in members.items():
            info = zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0))
            info.compress_type = method
            zipped.writestr(info, content)
    return out.getvalue()


def npz(arrays, method=zipfile.ZIP_STORED):
    return archive({key + ".npy": npy(value) for key, value in arrays.items()}, method)


def c3d(big, floats):
    """Two points, three frames, an analog value a frame."""
    order = ">" if big else "<"
    number = order + ("f" if floats else "h")
    head = bytearray(512)
    head[0:2] = b"\x02\x50"
    struct.pack_into(order + "5H", head, 2, 2, 1, 1, 3, 10)
    struct.pack_into(order + "f", head, 12, -1.0 if floats else 0.1)
    struct.pack_into(order + "HH", head, 16, 4, 1)
    struct.pack_into(order + "f", head, 20, 100.0)
    section = bytearray([1, 0x50, 2, 86 if big else 84])
    section += b"\x05\xffPOINT" + struct.pack(order + "H", 3) + b"\0"
    for name, kind, sizes, data in [(b"LABELS", -1, (4, 2), b"P:a b   "), (b"UNITS", -1, (2,), b"mm"),
                                    (b"RATE", 4, (), struct.pack(order + "f", 100.0)),
                                    (b"USED", 2, (), struct.pack(order + "h", 2))]:
        body = struct.pack("bB", kind, len(sizes)) + bytes(sizes) + data + b"\0"
        section += bytes([len(name), 1]) + name + struct.pack(order + "H", 2 + len(body)) + body
    section += bytes(1024 - len(section))
    points = []
    for frame in range(3):
        for point in range(2):
            points += [100 * point, 10, frame, -1 if (point, frame) == (1, 2) else 0]
        points.append(7)
    return bytes(head + section) + b"".join(struct.pack(number, p) for p in points)


def make_markers():
    put("markers", "intel_floats.c3d", c3d(False, True))
    put("markers", "cut_off.c3d", c3d(False, True)[:1600])
    put("markers", "mips_integers.c3d", c3d(True, False))
    put("markers", "two.trc", "PathFileType\t4\t(X/Y/Z)\tx.trc\nDataRate\tNumMarkers\tUnits\n60\t2\tm\n"
        "Frame#\tTime\tA\t\t\tB\t\t\n\t\tX1\tY1\tZ1\tX2\tY2\tZ2\n\n1\t0\t1\t2\t3\t4\t5\t6\n"
        "2\t0.1\t1\t2\t3\t\t\t\n")
    put("markers", "vicon.csv", "\ufeffTrajectories\n100\n,,P:a,,,P:b\nFrame,Sub Frame,X,Y,Z\n"
        ",,mm,mm,mm,mm,mm,mm\n7,0,1,2,3,,,\n8,0,1,2,3,4,5,6\n\n")
    put("markers", "qualisys.tsv", "NO_OF_FRAMES\t1\r\nNO_OF_MARKERS\t2\r\nFREQUENCY\t100\r\n"
        "MARKER_NAMES\ta\tb\r\nFrame\tTime\ta X\ta Y\ta Z\tb X\tb Y\tb Z\t\r\n"
        "1\t0.0\t1\t2\t3\tnan\tnan\tnan\r\n")


def make_bvh():
    offsets = "\tOFFSET 0 1 0\n"
    put("bvh", "three_joints.bvh", """HIERARCHY
ROOT Hips
{
  OFFSET 0.00 0.00 0.00
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Spine
  {
    OFFSET 0 5.21 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    End Site
    {
      OFFSET 0 4.5 0
    }
  }
  JOINT LeftUpLeg
  {
    OFFSET 3.91 0 0
    CHANNELS 3 Yrotation Xrotation Zrotation
    End Site
    {
      OFFSET 0 -18 0
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.0333333
8.03 35.01 88.36 -3.41 14.78 -164.35 13.09 40.30 -24.60 7.88 43.80 0.00
7.81 35.10 86.47 -3.78 12.94 -166.97 12.64 42.57 -22.34 7.67 43.61 1e-3
""")
    put("bvh", "one_line.bvh", "HIERARCHY ROOT a { OFFSET 0 0 0 CHANNELS 1 Xrotation End Site { "
        "OFFSET 1 1 1 } } MOTION Frames: 1 Frame Time: .5 90")
    put("bvh", "brace_on_line.bvh", "hierarchy\r\nroot my hips {\r\n" + offsets +
        "channels 0\r\njoint b{\r\n" + offsets + "CHANNELS 3 Xposition Yposition Zposition\r\n"
        "}\r\n}\r\nMotion\r\nFrames: 3\r\nFrame Time: 0.00833\r\n1 2 3\r\n4 5 6\r\n")
    put("bvh", "too_few_numbers.bvh", "HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 3 Zrotation "
        "Xrotation Yrotation\n}\nMOTION\nFrames: 100000\nFrame Time: 0.01\n1 2 3\n4 5\n")
    deep = 24
    put("bvh", "deep.bvh", "HIERARCHY\nROOT j\n{\nOFFSET 0 0 0\nCHANNELS 1 Zrotation\n" +
        "".join(f"JOINT j{i}\n{{\nOFFSET 0 1 0\n" for i in range(deep)) + "}\n" * (deep + 1) +
        "MOTION\nFrames: 1\nFrame Time: 0.01\n45\n")


ASF = """# made for tests
:version 1.10
:name test
:units
  mass 1.0
  length 0.45
  angle deg
:documentation
  three bones
:root
  order TX TY TZ RX RY RZ
  axis XYZ
  position 0 0 0
  orientation 0 0 0
:bonedata
  begin
    id 1
    name lhipjoint
    direction 0.6 -0.7 0.3
    length 2.4
    axis 0 0 0 XYZ
  end
  begin
    id 2
    name lfemur
    direction 0.34 -0.93 0
    length 7.1
    axis 0 0 20 XYZ
    dof rx ry rz
    limits (-160.0 20.0)
           (-70.0 70.0)
           (-60.0 70.0)
  end
:hierarchy
  begin
    root lhipjoint
    lhipjoint lfemur
  end
"""


def make_amc():
    motion = ":FULLY-SPECIFIED\n:DEGREES\n1\nroot 1 2 3 4 5 6\nlfemur 10 -20 30\n2\n" \
             "root 1 2 3 4 5 6e-1\nlfemur 1.5 2 3\n"
    put("amc", "two_bones", ASF + "\n----\n" + motion)
    put("amc", "no_header", ASF + "\n----\n1\nroot 1 2 3 4 5 6\nlfemur 0 0 0\n")
    put("amc", "radians", ASF.replace("angle deg", "angle rad") + "\n----\n#!OML:ASF test\n" +
        motion.replace(":DEGREES", ":RADIANS"))
    put("amc", "loop", ASF.replace("root lhipjoint", "lfemur lhipjoint") + "\n----\n" + motion)
    put("amc", "only_root", ":version 1.10\n:root\norder RX RY RZ TX TY TZ L\naxis ZYX\nposition 1 "
        "2 3\norientation 90 0 0\n:bonedata\n:hierarchy\nbegin\nend\n\n----\n1\nroot 1 2 3 4 5 6 "
        "7\n")


CORNERS = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
FACES = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)]


def make_obj():
    put("obj", "tetrahedron.obj", "# made for tests\nmtllib a.mtl\no thing\n" +
        "".join(f"v {x} {y} {z}\n" for x, y, z in CORNERS) + "usemtl red\ns off\n" +
        "".join("f " + " ".join(str(i + 1) for i in f) + "\n" for f in FACES))
    put("obj", "quad_with_normals.obj", "v 0 0 0 1\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\n"
        "vn 0 0 1\ng part\nf 1/1/1 2/2/1 3/1/1 4//1\nf 1/1 2/2 3/1\nl 1 2\n")
    put("obj", "from_the_end.obj", "v 1e-3 -2.5E2 +3\r\nv 0 0 .5\r\nv 1. 1 1\r\nf -3 -2 -1 # c\r\n")
    put("obj", "no_such_vertex.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n")
    put("obj", "repeated_corner.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 2\nf 1 2 3\nf 3 2 1\n")


def make_off():
    body = "4 4 6\n" + "".join(f"{x} {y} {z}\n" for x, y, z in CORNERS) + \
        "".join("3 " + " ".join(map(str, f)) + "\n" for f in FACES)
    put("off", "tetrahedron.off", "OFF\n" + body)
    put("off", "on_the_first_line.off", "OFF " + body)
    put("off", "colors.off", "COFF\n# c\n3 1 0\n0 0 0 255 0 0 255\n1 0 0 0 255 0 255\n\n0 1 0 0 0 "
        "1 1\n3 0 1 2 0.5 0.5 0.5\n")
    put("off", "promises_more.off", "OFF\n1000000000 4 6\n0 0 0\n")
    put("off", "polygon.off", "OFF\n5 1 0\n0 0 0\n1 0 0\n2 1 0\n1 2 0\n0 1 0\n5 0 1 2 3 4\n")


def make_stl():
    def facets(f):
        return "".join(f(*[CORNERS[i] for i in face]) for face in FACES)
    text = facets(lambda a, b, c: "facet normal 0 0 0\nouter loop\n" + "".join(
        "vertex %g %g %g\n" % p for p in (a, b, c)) + "endloop\nendfacet\n")
    put("stl", "text.stl", "solid made for tests\n" + text + "endsolid\n")
    put("stl", "capitals.stl", ("solid x\n" + text + "endsolid x\n").upper())
    binary = b"".join(struct.pack("<12fH", 0, 0, 0, *[x for i in f for x in CORNERS[i]], 0)
                      for f in FACES)
    put("stl", "binary.stl", b"made for tests".ljust(80, b" ") + struct.pack("<I", 4) + binary)
    put("stl", "binary_called_solid.stl", b"solid".ljust(80, b"\0") + struct.pack("<I", 1) +
        binary[:50])
    put("stl", "cut.stl", b"".ljust(80, b"\0") + struct.pack("<I", 2 ** 31) + binary)


def make_ply():
    header = "ply\nformat {} 1.0\ncomment made for tests\nelement vertex 4\nproperty {} x\n" \
             "property {} y\nproperty {} z\nelement face 4\nproperty list uchar {} " \
             "vertex_indices\nend_header\n"
    text = "".join("%g %g %g\n" % p for p in CORNERS) + "".join("3 %d %d %d\n" % f for f in FACES)
    put("ply", "text.ply", header.format("ascii", "float", "float", "float", "int") + text)
    for order, sign in (("little", "<"), ("big", ">")):
        for kind, letter in (("float", "f"), ("double", "d")):
            body = b"".join(struct.pack(sign + "3" + letter, *p) for p in CORNERS) + \
                b"".join(struct.pack(sign + "B3i", 3, *f) for f in FACES)
            put("ply", f"{order}_{kind}.ply", header.format(
                f"binary_{order}_endian", kind, kind, kind, "int").encode() + body)
    put("ply", "more_elements.ply", "ply\nformat ascii 1.0\nobj_info a\nelement camera 1\nproperty "
        "float view_px\nproperty list uchar short k\nelement vertex 3\nproperty uchar red\nproperty "
        "double x\nproperty double y\nproperty double z\nproperty list uint8 float32 w\nelement "
        "face 1\nproperty list ushort uint vertex_index\nproperty int8 flag\nelement edge 0\n"
        "end_header\n1.5 2 7 8\n255 0 0 0 1 0.5\n0 1 0 0 0\n0 0 1 0 2 1 2\n3 0 1 2 -1\n")
    put("ply", "promises_more.ply", header.format(
        "binary_little_endian", "float", "float", "float", "int").replace("vertex 4",
                                                                          "vertex 1000000000"))
    put("ply", "polygon.ply", "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty "
        "float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\n"
        "end_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n")


def make_skeleton_map():
    put("skeleton_map", "all.json", json.dumps({name: name for name in BODY}))
    put("skeleton_map", "comments.json", "{ // joints\n" + ",\n".join(
        f'"{name}": "{name}"' for name in BODY if "foot" not in name) + " /* end */ }")
    put("skeleton_map", "twice.json", json.dumps({"root": "pelvis", "pelvis": "pelvis"}))
    put("skeleton_map", "sides_crossed.json", json.dumps(
        {n: n.replace("left_knee", "right_knee") if n == "left_knee" else
         n.replace("right", "left") if n == "right_knee" else n for n in BODY}))
    put("skeleton_map", "not_names.json", '{"pelvis": 1, "head": ["neck", {"a": null}], "\\u00e9": '
        '-1.5e300, "": true}')
    put("skeleton_map", "deep.json", "[" * 200 + "]" * 200)


def make_npz():
    values = np.arange(6).reshape(2, 3)
    put("npz", "orders.npz", npz({"c": values.astype("<f4"), "big": values.astype(">f8"),
                                  "fortran": np.asfortranarray(values.astype("<f2"))}))
    put("npz", "integers.npz", npz({d[1:]: np.arange(3).astype(d) for d in
                                    ("|i1", "|u1", "<i2", ">u2", "<i4", "<u4", ">i8", "<u8")}))
    put("npz", "texts.npz", npz({"u": np.array("smplx"), "s": np.array(b"neutral"),
                                 "list": np.array(["a", "bcd"]), "flag": np.array(True)}))
    put("npz", "deflated.npz", npz({"zeros": np.zeros((40, 3))}, zipfile.ZIP_DEFLATED))
    put("npz", "empty.npz", npz({"none": np.zeros((0, 3)), "scalar": np.float64(np.nan)}))
    put("npz", "objects.npz", archive({"o.npy": npy_object({"a": values, "b": [1, "x", None]})}))
    put("npz", "version_2.npz", archive({"a.npy": npy(values, (2, 0)),
                                         "b.npy": npy(values, (3, 0)), "notes.txt": b"hello"}))
    put("npz", "no_members.npz", archive({}))


def npy_object(value):
    out = io.BytesIO()
    np.lib.format.write_array(out, np.array(value, dtype=object), allow_pickle=True)
    return out.getvalue()


def clip_arrays(frames, parts=True):
    rng = np.random.default_rng(1)
    arrays = {"mocap_frame_rate": np.float64(30), "trans": rng.normal(size=(frames, 3)),
              "betas": np.zeros(2), "gender": np.array("neutral")}
    if parts:
        arrays.update(root_orient=np.zeros((frames, 3), "f4"),
                      pose_body=np.zeros((frames, 63), "f2"))
    else:
        arrays["poses"] = np.zeros((frames, 165), "f2")
    return arrays


def make_clip():
    put("clip", "parts.npz", npz(clip_arrays(2)))
    put("clip", "poses.npz", npz(clip_arrays(1, False)))
    full = clip_arrays(2)
    full.update(object_trans=np.zeros((2, 3)), object_orient=np.ones((2, 3)),
                object_name=np.array("mug"), object_mesh=np.array("mug.ply"),
                holding_hand=np.array([0, 3], "u1"), subject=np.array("s1"),
                action=np.array("drink"), v_template=np.zeros((2, 3), "f4"))
    put("clip", "object.npz", npz(full))
    table = clip_arrays(1)
    table.update(table_trans=np.zeros((1, 3)), table_orient=np.zeros((1, 3)),
                 table_name=np.array("table"), contact_object=np.array([[0, 22, 41]], "u1"),
                 contact_body=np.array([[1]], "i8"), pose_hand=np.zeros((1, 90), "f2"),
                 pose_jaw=np.zeros((1, 3)), pose_eye=np.zeros((1, 6), "i1"))
    put("clip", "labels.npz", npz(table))
    uneven = clip_arrays(2)
    uneven["trans"] = uneven["trans"][:1]
    put("clip", "uneven_lengths.npz", npz(uneven))
    old = clip_arrays(1, False)
    old["mocap_framerate"] = old.pop("mocap_frame_rate")
    put("clip", "old_spelling.npz", npz(old, zipfile.ZIP_DEFLATED))


def make_pickle():
    # The fixtures of the pickle tests (tests/fixtures/pickle) are seeds as well.
    shared = [1]
    plain = {"a": [1, -2, 2 ** 40, 1.5, True, None], "t": ("x", b"y"), "s": {3}, "again": shared,
             "n": {"m": [shared]}, "\u00e9": -(2 ** 62), 7: "seven"}
    for protocol in range(6):
        put("pickle", f"plain_p{protocol}.pkl", pickle.dumps(plain, protocol))
        put("pickle", f"array_p{protocol}.pkl", pickle.dumps(
            {"trans": np.arange(6, dtype=">f4").reshape(2, 3), "k": np.int64(3)}, protocol))
    loop = []
    loop.append(loop)
    put("pickle", "loop.pkl", pickle.dumps(loop, 2))
    put("pickle", "ordered.pkl", pickle.dumps(collections.OrderedDict(
        b=bytearray(b"z"), a=frozenset([1]), c=np.array(["ab", "c"]),
        d=np.asfortranarray(np.eye(2)), e=np.array([1, None], dtype=object)), 4))
    # Each level names the one below twice: 2^40 values for who follows them all.
    laughs = b"\x80\x02]q\x00" + b"".join(b"](h" + bytes([i]) + b"h" + bytes([i]) + b"eq" +
                                         bytes([i + 1]) for i in range(40)) + b"."
    put("pickle", "shared_levels.pkl", laughs)
    put("pickle", "system.pkl", b"cos\nsystem\n(S'true'\ntR.")
    put("pickle", "deep.pkl", b"\x80\x02" + b"]" * 300 + b"a" * 299 + b".")


def make_torch():
    # Those of tests/fixtures/torch are seeds as well: this one is as small as they get.
    data = b"\x80\x02ctorch._utils\n_rebuild_tensor_v2\nq\x00((X\x07\x00\x00\x00storageq\x01" \
           b"ctorch\nFloatStorage\nq\x02X\x01\x00\x00\x000q\x03X\x03\x00\x00\x00cpuq\x04" \
           b"K\x04tq\x05QK\x00K\x02K\x02\x86q\x06K\x02K\x01\x86q\x07\x89ccollections\n" \
           b"OrderedDict\nq\x08)Rq\ttq\nRq\x0b."
    put("torch", "tensor.pt", archive({"a/data.pkl": data, "a/byteorder": b"little",
                                       "a/data/0": np.arange(4, dtype="<f4").tobytes(),
                                       "a/version": b"3\n"}))


def make_safetensors():
    def tensors(header, data=b"", pad=0):
        text = (header if isinstance(header, str) else json.dumps(header)).encode() + b" " * pad
        return struct.pack("<Q", len(text)) + text + data
    put("safetensors", "two.safetensors", tensors(
        {"__metadata__": {"format": "pt"},
         "w": {"dtype": "F32", "shape": [2, 2], "data_offsets": [0, 16]},
         "b": {"dtype": "I64", "shape": [], "data_offsets": [16, 24]}}, bytes(range(24)), 5))
    put("safetensors", "types.safetensors", tensors(
        {name: {"dtype": name, "shape": [1], "data_offsets": [at, at + size]}
         for name, at, size in (("F64", 0, 8), ("BF16", 8, 2), ("F16", 10, 2), ("U8", 12, 1),
                                ("BOOL", 13, 1), ("I8", 14, 1), ("F8_E4M3", 15, 1),
                                ("U64", 16, 8), ("I16", 24, 2), ("U16", 26, 2), ("I32", 28, 4),
                                ("U32", 32, 4))}, bytes(36)))
    put("safetensors", "none.safetensors", tensors("{}"))
    put("safetensors", "overlap.safetensors", tensors(
        {"a": {"dtype": "U8", "shape": [4], "data_offsets": [0, 4]},
         "b": {"dtype": "U8", "shape": [4], "data_offsets": [2, 6]}}, bytes(6)))
    put("safetensors", "huge_header.safetensors", struct.pack("<Q", 2 ** 63) + b"{}")


def glb(model, data):
    text = json.dumps(model, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    data += b"\0" * (-len(data) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + \
        struct.pack("<I4s", len(data), b"BIN\0") + data
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def make_gltf():
    parts = [np.array([0, 0.5, 1], "<f4"),  # times
             np.array([[0, 0, 0, 1], [0, 0.6, 0, 0.8], [1, 0, 0, 0]], "<f4"),
             np.array([[0, 0, 0], [0, 1, 0], [0.5, 1, 0]], "<f4"),
             np.tile(np.eye(4, dtype="<f4").ravel(), (3, 1)),
             np.array([[0, 0, 32767, 0], [0, -32767, 0, 0], [0, 0, 0, 32767]], "<i2")]
    kinds = [("SCALAR", 5126), ("VEC4", 5126), ("VEC3", 5126), ("MAT4", 5126), ("VEC4", 5122)]
    data, views, accessors = b"", [], []
    for part, (kind, component) in zip(parts, kinds):
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": part.nbytes})
        accessors.append({"bufferView": len(views) - 1, "componentType": component, "count": 3,
                          "type": kind})
        data += part.tobytes()
    accessors[0].update(min=[0], max=[1])
    accessors[4]["normalized"] = True
    model = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 3]}],
             "nodes": [{"name": "hips", "children": [1], "translation": [0, 1, 0]},
                       {"name": "spine", "children": [2], "rotation": [0, 0, 0, 1]},
                       {"name": "head", "matrix": np.eye(4).ravel().tolist()},
                       {"name": "body", "mesh": 0, "skin": 0}],
             "meshes": [{"primitives": [{"attributes": {"POSITION": 2}}]}],
             "skins": [{"joints": [0, 1, 2], "inverseBindMatrices": 3}],
             "animations": [{"name": "walk",
                             "samplers": [{"input": 0, "output": 1},
                                          {"input": 0, "output": 2, "interpolation": "STEP"},
                                          {"input": 0, "output": 4}],
                             "channels": [{"sampler": 0, "target": {"node": 0, "path": "rotation"}},
                                          {"sampler": 1,
                                           "target": {"node": 0, "path": "translation"}},
                                          {"sampler": 2,
                                           "target": {"node": 1, "path": "rotation"}}]}],
             "bufferViews": views, "accessors": accessors, "buffers": [{"byteLength": len(data)}]}
    put("gltf", "three_joints.glb", glb(model, data))
    inside = dict(model, buffers=[{"byteLength": len(data), "uri":
                                   "data:application/octet-stream;base64," +
                                   base64.b64encode(data).decode()}])
    put("gltf", "three_joints.gltf", json.dumps(inside))
    without_skin = {k: v for k, v in model.items() if k != "skins"}
    without_skin["nodes"] = model["nodes"][:3] + [{"name": "body"}]
    put("gltf", "without_skin.glb", glb(without_skin, data))
    spline = json.loads(json.dumps(model))
    spline["animations"][0]["samplers"] = [{"input": 5, "output": 2,
                                            "interpolation": "CUBICSPLINE"}]
    spline["animations"][0]["channels"] = [{"sampler": 0,
                                            "target": {"node": 0, "path": "translation"}}]
    spline["accessors"].append({"bufferView": 0, "componentType": 5126, "count": 1,
                                "type": "SCALAR", "min": [0], "max": [0]})
    put("gltf", "spline.glb", glb(spline, data))
    sparse = json.loads(json.dumps(model))
    sparse["accessors"][2]["sparse"] = {"count": 1, "indices": {"bufferView": 0, "componentType":
                                        5121}, "values": {"bufferView": 2}}
    put("gltf", "sparse.glb", glb(sparse, data))
    loop = json.loads(json.dumps(model))
    loop["nodes"][2]["children"] = [0]
    put("gltf", "nodes_in_a_loop.glb", glb(loop, data))
    put("gltf", "file_beside_it.gltf", json.dumps(dict(model, buffers=[
        {"byteLength": len(data), "uri": "../../etc/passwd"}])))


def make_data_file():
    put("data_file", "array.npy", npy(np.arange(6, dtype="<f4").reshape(2, 3)))
    put("data_file", "objects.npy", npy_object({"betas": np.zeros(3), "name": "s1"}))
    put("data_file", "two.npz", npz({"a": np.eye(2), "b": np.array("text")}))
    put("data_file", "values.pkl", pickle.dumps({"a": np.eye(2), "b": [1, 2.5, "x"]}, 4))
    put("data_file", "values.json", json.dumps({"pose": [[0, 1.5], [2, 3]], "deep": {"a": [None,
        True, "\u00e9\U0001f600", -1e300, 2 ** 53]}}))
    put("data_file", "values.json.gz", gzip.compress(b'{"a": [1, 2, 3]}', mtime=0))
    put("data_file", "array.npy.gz", gzip.compress(npy(np.zeros(50)), mtime=0))
    legacy = b"".join(pickle.dumps(v, 2) for v in (
        0x1950a86a20f9469cfc6c, 1001, {"protocol_version": 1001, "little_endian": True,
                                       "type_sizes": {"short": 2, "int": 4, "long": 4}}))
    tensor = b"\x80\x02ctorch._utils\n_rebuild_tensor_v2\nq\x00((X\x07\x00\x00\x00storageq\x01" \
             b"ctorch\nFloatStorage\nq\x02X\x01\x00\x00\x009q\x03X\x03\x00\x00\x00cpuq\x04" \
             b"K\x02Ntq\x05QK\x00K\x02\x85q\x06K\x01\x85q\x07\x89ccollections\nOrderedDict\n" \
             b"q\x08)Rq\ttq\nRq\x0b."
    put("data_file", "legacy_torch.pt", legacy + tensor + pickle.dumps(["9"], 2) +
        struct.pack("<q2f", 2, 1.5, -2))
    put("data_file", "web_page.html", "<!DOCTYPE html><html></html>")
    put("data_file", "tensors.safetensors", (ROOT / "safetensors/two.safetensors").read_bytes())


def make_hand_sets():
    """Layouts of data sets as JSON of a frame or two: mutated without a container in the way."""
    angles = [round(0.01 * k - 0.2, 2) for k in range(48)]
    place, matrix = [0.1, 0.2, 0.3], [[1, 0, 0, 0.1], [0, 1, 0, 0], [0, 0, 1, 0.5], [0, 0, 0, 1]]
    smplx = {"global_orient": [[1.57, 0, 0]] * 2, "transl": [place] * 2, "body_pose": [[0.1] * 63] * 2, "betas": [[0] * 10]}
    hot3d = {"pose": [0.1] * 15, "betas": [0] * 10, "wrist_xform": {"q_wxyz": [1, 0, 0, 0], "t_xyz": place}}
    layouts = {
        "ho3d": {"handPose": angles, "handTrans": place, "handBeta": [0] * 10, "objRot": place, "objTrans": place, "objName": "mug"},
        "dexycb": {"pose_m": [angles + place], "pose_y": [matrix[:3]]},
        "oakink": {"hand_pose": angles, "hand_shape": [0] * 10, "hand_tsl": place, "obj_transf": matrix},
        "taco": {"00001": {"hand_pose": angles, "hand_trans": place}, "00002": {"hand_pose": angles, "hand_trans": place}},
        "easymocap": {"right": {"poses": [angles], "Rh": [place], "Th": [place], "shapes": [[0] * 10]}},
        "contactpose": [{"valid": False}, {"valid": True, "pose": angles[:18], "betas": [0] * 10,
                                           "mTc": {"rotation": [1, 0, 0, 0], "translation": place}}],
        "smplx": smplx, "people": {"0": smplx, "1": smplx}, "frames": [smplx, smplx],
        "gvhmr": {"smpl_params_global": smplx, "smpl_params_incam": smplx},
        "wham": {"0": {"pose_world": [[0.1] * 72], "trans_world": [place], "betas": [[0] * 10]}},
        "omomo": {"0": {"seq_name": "sub3_largebox_000", "root_orient": [place], "trans": [place], "pose_body": [[0.1] * 63],
                        "betas": [[0] * 16], "gender": "male", "obj_rot": [[r[:3] for r in matrix[:3]]], "obj_trans": [place],
                        "obj_scale": [0.5]}},
        "mano": {"global_orient": [place], "hand_pose": [angles[3:]], "transl": [place], "is_rhand": [True]},
        "array": [angles, angles]}
    for name, values in layouts.items():
        put("hand_sets", name + ".json", json.dumps(values))
    put("hand_sets", "hot3d.jsonl", "".join(json.dumps({"timestamp_ns": 1000 * t, "hand_poses": {"0": hot3d, "1": hot3d}}) + "\n"
                                            for t in (1, 2)))
    put("hand_sets", "hocap.npy", npy(np.full((2, 2, 51), 0.1, np.float32)))
    put("hand_sets", "mano_poses.npy", npy(np.full((2, 48), 0.1, np.float32)))
    put("hand_sets", "not_known.json", json.dumps({"hand": place}))


def make_robot():
    def link(name, size):
        return (f'<link name="{name}"><visual><origin xyz="0 0 {size / 2}"/><geometry><box size="'
                f'{size / 2} {size / 2} {size}"/></geometry></visual></link>')

    def joint(parent, child, more=""):
        return (f'<joint name="to_{child}" type="revolute"><parent link="{parent}"/><child link='
                f'"{child}"/><origin xyz="0 0 0.08" rpy="0.1 0 0"/><axis xyz="0 1 0"/><limit '
                f'lower="-0.1" upper="1.5" effort="1" velocity="1"/>{more}</joint>')

    palm = '<?xml version="1.0"?>\n<robot name="hand"><!-- two fingers -->' + link("palm", 0.08)
    whole = (palm + link("a", 0.05) + joint("palm", "a") + link("b", 0.04) + joint("palm", "b", (
        '<mimic joint="to_a" multiplier="0.7" offset="0.05"/>')) + "</robot>")
    put("robot", "two_fingers.urdf", whole)
    put("robot", "capsule.urdf", whole.replace('<box size="0.02 0.02 0.04"/>',
                                               '<capsule radius="0.01" length="0.02"/>'))
    put("robot", "mesh_missing.urdf", whole.replace('<box size="0.02 0.02 0.04"/>',
                                                    '<mesh filename="package://hand/none.stl"/>'))
    put("robot", "follows_nobody.urdf", whole.replace('mimic joint="to_a"', 'mimic joint="to_c"'))
    put("robot", "nested.urdf", "<robot>" + "<link>" * 300)
    body = ('<mujoco><compiler angle="radian"/><worldbody><body name="palm"><geom type="box" size='
            '"0.04 0.01 0.04"/><body name="f" pos="0.03 0 0.08"><joint name="j" axis="1 0 0" range='
            '"0 1.5" limited="true"/><geom type="capsule" size="0.01 0.03"/></body></body>'
            '</worldbody></mujoco>')
    put("robot", "finger.xml", body)
    put("robot", "not_finite.xml", body.replace("0.01 0.03", "&#110;an 0.03"))
    put("robot", "composite.xml", body.replace("<worldbody>", (
        '<worldbody><body><composite type="grid" count="1000 1000 1" spacing="1"/></body>')))


MAKERS = {name[5:]: make for name, make in list(globals().items()) if name.startswith("make_")}

if __name__ == "__main__":
    for target in sys.argv[1:] or MAKERS:
        MAKERS[target]()
