// SPDX-License-Identifier: MIT
#include "geometry/import/file_kind.h"

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <optional>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/import/content_kind.h"
#include "geometry/io/container/byte_source.h"
#include "geometry/io/container/text_scanner.h"
#include "geometry/io/markers/c3d.h"
#include "geometry/io/markers/marker_recording.h"
#include "geometry/io/mesh/mesh_scan.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kHeadBytes = 1 << 16;

// Returns `count` characters from `at`, fewer at the end of the head.
std::string_view Part(std::string_view head, std::size_t at, std::size_t count) {
  return at < head.size() ? head.substr(at, count) : std::string_view();
}

bool IsText(std::string_view head) {
  // Latin-1 or UTF-8: no control characters except white space.
  return std::ranges::all_of(head, [](char c) {
    const auto u = static_cast<unsigned char>(c);
    return u >= 32 || c == '\n' || c == '\r' || c == '\t' || c == '\f';
  });
}

std::string_view TrimLeft(std::string_view text) {
  if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);  // byte order mark
  while (!text.empty() && std::isspace(static_cast<unsigned char>(text.front()))) {
    text.remove_prefix(1);
  }
  return text;
}

bool StartsWithIgnoringCase(std::string_view text, std::string_view start) {
  return text.size() >= start.size() && EqualIgnoringCase(text.substr(0, start.size()), start);
}

// Protocol 2 and later state it in the first bytes. Earlier ones are text that starts with one of a
// few opcodes and names what it needs as "c<module>\n<name>\n".
bool IsPickle(std::string_view head) {
  if (head.size() >= 2 && head[0] == '\x80' && head[1] >= 2 && head[1] <= 5) return true;
  if (head.size() < 3 || std::string_view("(]}c").find(head[0]) == std::string_view::npos) {
    return false;
  }
  return head.starts_with("(dp") || head.starts_with("(lp") || head.starts_with("ccopy_reg\n") ||
         head.starts_with("cnumpy") || head.starts_with("}q") || head.starts_with("]q");
}

// Older torch files are several pickles; the first one holds this number.
bool IsOldTorch(std::string_view head) {
  return head.substr(0, 14) ==
         std::string_view("\x80\x02\x8a\x0a\x6c\xfc\x9c\x46\xf9\x20\x6a\xa8\x50\x19", 14);
}

bool IsSafetensors(std::string_view head, std::size_t bytes) {
  if (head.size() < 10 || head[8] != '{') return false;
  const std::uint64_t length = FromLittleEndian(head.substr(0, 8));
  return length >= 2 && length <= bytes - 8;
}

FileKind BinaryKind(std::string_view head, std::size_t bytes) {
  using std::string_view_literals::operator""sv;
  if (head.starts_with("\x93NUMPY"sv)) return FileKind::kNpy;
  if (IsOldTorch(head)) return FileKind::kTorch;
  if (head.starts_with("glTF"sv)) return FileKind::kGlb;
  if (head.starts_with("\x89HDF\r\n\x1a\n"sv) || head.starts_with("MATLAB 7.3"sv)) {
    return FileKind::kHdf5;
  }
  if (head.starts_with("MATLAB 5.0 MAT-file"sv)) return FileKind::kMatlab;
  if (head.starts_with("Kaydara FBX Binary"sv)) return FileKind::kFbx;
  if (head.starts_with("PXR-USDC"sv)) return FileKind::kUsd;
  if (head.starts_with("\x89PNG\r\n"sv) || head.starts_with("\xff\xd8\xff"sv) ||
      head.starts_with("GIF8"sv) || head.starts_with("BM"sv) ||
      (head.starts_with("RIFF"sv) && Part(head, 8, 4) == "WEBP"sv)) {
    return FileKind::kPicture;
  }
  if (Part(head, 4, 4) == "ftyp"sv || head.starts_with("\x1a\x45\xdf\xa3"sv) ||
      (head.starts_with("RIFF"sv) && Part(head, 8, 4) == "AVI "sv)) {
    return FileKind::kVideo;
  }
  if (IsSafetensors(head, bytes)) return FileKind::kSafetensors;
  if (head.size() >= 84 && bytes == 84 + 50 * FromLittleEndian(head.substr(80, 4))) {
    return FileKind::kStl;
  }
  if (IsPickle(head)) return FileKind::kPickle;
  if (LooksLikeC3d(head)) return FileKind::kMarkers;
  // Some bytes may follow the triangles.
  constexpr std::size_t kTrailing = 4096;
  if (head.size() > 84 && FromLittleEndian(head.substr(80, 4)) > 0) {
    const std::size_t end = 84 + 50 * FromLittleEndian(head.substr(80, 4));
    if (bytes >= end && bytes - end <= kTrailing && !IsText(head)) return FileKind::kStl;
  }
  return FileKind::kUnknown;
}

// Whether the lines are those of an .obj: vertices and keywords, and few other words.
bool IsObj(std::string_view start) {
  const std::string plain = PlainLines(start, true);
  std::string_view head = plain;
  int vertices = 0, others = 0;
  while (!head.empty()) {
    const std::size_t end = head.find('\n');
    const std::string_view line = TrimLeft(head.substr(0, end));
    const std::string_view word = line.substr(0, line.find_first_of(" \t\r"));
    if (word == "v") {
      ++vertices;
    } else if (!word.empty() && word.front() != '#') {
      static constexpr std::string_view kWords[] = {
          "f",      "vt",   "vn",   "vp",     "g",      "o",     "s",        "usemtl",
          "mtllib", "l",    "p",    "usemap", "maplib", "mg",    "cstype",   "deg",
          "bmat",   "step", "curv", "curv2",  "surf",   "parm",  "trim",     "hole",
          "scrv",   "sp",   "end",  "con",    "lod",    "bevel", "c_interp", "d_interp"};
      // The last line may be truncated.
      if (end != std::string_view::npos && std::ranges::find(kWords, word) == std::end(kWords)) {
        ++others;
      }
    }
    head = end == std::string_view::npos ? std::string_view() : head.substr(end + 1);
  }
  return vertices > 0 && others <= vertices / 100;
}

FileKind TextKind(std::string_view head) {
  if (!MarkerFormatOf(head).empty()) return FileKind::kMarkers;
  if (const FileKind motion = MotionTextKind(head); motion != FileKind::kUnknown) return motion;
  const std::string_view text = TrimLeft(head);
  if (text.starts_with("version https://git-lfs.github.com/spec/")) return FileKind::kGitLfsPointer;
  if (StartsWithIgnoringCase(text, "<!doctype html") || StartsWithIgnoringCase(text, "<html")) {
    return FileKind::kHtml;
  }
  if (text.starts_with("#usda")) return FileKind::kUsd;
  if (text.starts_with("; FBX")) return FileKind::kFbx;
  if (StartsWithIgnoringCase(text, "solid") && text.find("facet") != std::string_view::npos) {
    return FileKind::kStl;
  }
  const std::string_view first = TextScanner("", head, '#').Next();
  const std::size_t digits = std::min(first.find_first_of("0123456789"), first.size());
  if (first.substr(0, digits) == "OFF" || first == "OFF" || first == "COFF" || first == "NOFF" ||
      first == "STOFF" || first == "4OFF") {
    return FileKind::kOff;
  }
  if (IsPickle(text)) return FileKind::kPickle;
  if (IsObj(head)) return FileKind::kObj;
  return FileKind::kText;
}

FileKind PlyKind(std::string_view head) {
  const std::size_t end = head.find("end_header");
  const auto has = [&](std::string_view element) {
    const std::size_t at = head.find(element);
    const std::string_view count = Part(head, at + element.size(), 2);
    return at != std::string_view::npos && (end == std::string_view::npos || at < end) &&
           count != "0\n" && count != "0\r";
  };
  const bool faces = has("element face ") || has("element tristrips ");
  return faces || end == std::string_view::npos ? FileKind::kPly : FileKind::kPlyPoints;
}

FileKind KindOf(std::string_view head, std::size_t bytes) {
  if (head.starts_with("ply\n") || head.starts_with("ply\r")) return PlyKind(head);
  const FileKind binary = BinaryKind(head, bytes);
  if (binary != FileKind::kUnknown) return binary;
  return IsText(head) ? TextKind(head) : FileKind::kUnknown;
}

// Kind of a missing path, folder or device; nullopt for a regular file.
std::optional<FileKind> KindByStatus(const fs::path& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (status.type() == fs::file_type::not_found) return FileKind::kMissing;
  if (error) return FileKind::kUnreadable;  // such as a loop of symbolic links
  if (fs::is_directory(status)) {
    const bool result =
        fs::exists(path / "clip.npz", error) && fs::exists(path / "metrics.json", error);
    return result ? FileKind::kResultFolder : FileKind::kFolder;
  }
  if (!fs::is_regular_file(status)) return FileKind::kSpecial;
  return std::nullopt;
}

}  // namespace

FileKind MotionTextKind(std::string_view text) {
  TextScanner words("", text, '#');
  const std::string_view first = words.Next();
  if (EqualIgnoringCase(first, "HIERARCHY")) return FileKind::kBvh;
  for (const std::string_view word :
       {":FULLY-SPECIFIED", ":DEGREES", ":RADIANS", ":SAMPLES-PER-SECOND"}) {
    if (EqualIgnoringCase(first, word)) return FileKind::kAmc;
  }
  for (const std::string_view word : {":version", ":name", ":units", ":root", ":documentation"}) {
    if (EqualIgnoringCase(first, word)) return FileKind::kAsf;
  }
  double number = 0;
  if (ParseNumber(first, number) && EqualIgnoringCase(words.Peek(), "root")) return FileKind::kAmc;
  return FileKind::kUnknown;
}

bool IsMesh(FileKind kind) {
  return kind == FileKind::kObj || kind == FileKind::kPly || kind == FileKind::kStl ||
         kind == FileKind::kOff;
}

Identity Identify(const fs::path& path) {
  Identity identity;
  if (const auto kind = KindByStatus(path)) {
    identity.kind = *kind;
    return identity;
  }
  std::string head;
  try {
    const ByteSource source(path);
    identity.bytes = source.Size();
    head = source.Head(kHeadBytes);
  } catch (const Error& error) {
    std::error_code ignored;
    if (fs::file_size(path, ignored) != 0) {
      identity.kind = FileKind::kUnreadable;
      identity.fault = error.Problem();
      return identity;
    }
  }
  if (head.empty()) {
    identity.kind = FileKind::kEmpty;
    return identity;
  }
  if (head.starts_with("\x1f\x8b")) {
    identity.gzipped = true;
    head = ReadGzipHead(path, kHeadBytes);
    if (head.empty()) {
      identity.kind = FileKind::kDamagedArchive;
      identity.fault = "a gzip file whose content cannot be unpacked";
      return identity;
    }
  }
  std::vector<std::string> ignored;
  head = PlainText(std::move(head), ignored);
  if (head.starts_with("PK\x03\x04") || head.starts_with("PK\x05\x06")) {
    if (identity.gzipped) {
      identity.kind = FileKind::kZip;
    } else {
      IdentifyArchive(path, identity);
    }
  } else if (const char first = TrimLeft(head).empty() ? '\0' : TrimLeft(head).front();
             (first == '{' || first == '[') && IsText(head)) {
    IdentifyJson(path, identity);
  } else {
    identity.kind = KindOf(head, identity.gzipped ? 0 : identity.bytes);
  }
  return identity;
}

}  // namespace holdfast
