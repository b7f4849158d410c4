// SPDX-License-Identifier: MIT
#include "geometry/robot/robot_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <optional>
#include <set>
#include <system_error>

#include <fmt/format.h>

#include "geometry/error.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxBytes = 64'000'000;           // total text
constexpr std::uintmax_t kMaxNamedBytes = 512'000'000;  // per mesh or image
constexpr std::size_t kMaxDepth = 200;                  // the libraries' parsers are recursive
constexpr double kMaxElements = 20'000, kMaxLinks = 1000;
constexpr std::size_t kMaxFiles = 2000, kMaxFolders = 32, kMaxAttributes = 200;
constexpr double kMaxCopies = 1000;                       // instances created by one element
constexpr double kMaxCells = 5e7;                         // of an image or height field
constexpr double kMaxSize = 1e7, kMaxUserNumbers = 1000;  // MJCF's <size>

constexpr std::string_view kBlanks = " \t\r\n";

bool IsBlank(char c) { return kBlanks.find(c) != std::string_view::npos; }

void AppendUtf8(unsigned long code, std::string& text) {
  if (code < 0x80) {
    text += static_cast<char>(code);
  } else if (code < 0x800) {
    text += static_cast<char>(0xC0 | (code >> 6));
    text += static_cast<char>(0x80 | (code & 0x3F));
  } else if (code < 0x10000) {
    text += static_cast<char>(0xE0 | (code >> 12));
    text += static_cast<char>(0x80 | ((code >> 6) & 0x3F));
    text += static_cast<char>(0x80 | (code & 0x3F));
  } else if (code < 0x110000) {
    text += static_cast<char>(0xF0 | (code >> 18));
    text += static_cast<char>(0x80 | ((code >> 12) & 0x3F));
    text += static_cast<char>(0x80 | ((code >> 6) & 0x3F));
    text += static_cast<char>(0x80 | (code & 0x3F));
  }
}

// Resolves the predefined XML entities and character references; others are kept.
std::string Resolved(std::string_view value) {
  constexpr std::array<std::pair<std::string_view, char>, 5> kNamed = {
      {{"lt", '<'}, {"gt", '>'}, {"amp", '&'}, {"quot", '"'}, {"apos", '\''}}};
  std::string text;
  for (std::size_t k = 0; k < value.size(); ++k) {
    const std::size_t end = value[k] == '&' ? value.find(';', k) : std::string_view::npos;
    if (end == std::string_view::npos || end - k > 10) {
      text += value[k];
      continue;
    }
    const std::string name(value.substr(k + 1, end - k - 1));
    const auto* const known =
        std::ranges::find(kNamed, name, [](const auto& n) { return n.first; });
    if (known != kNamed.end()) {
      text += known->second;
    } else if (name.size() > 1 && name[0] == '#') {
      const bool hex = name[1] == 'x';
      AppendUtf8(std::strtoul(name.c_str() + (hex ? 2 : 1), nullptr, hex ? 16 : 10), text);
    } else {
      text += value.substr(k, end - k + 1);
    }
    k = end;
  }
  return text;
}

// Returns the numbers at the start of a text, up to the first token that is not a number.
std::vector<double> LeadingNumbers(const std::string& text) {
  std::vector<double> numbers;
  const char* at = text.c_str();
  while (true) {
    while (*at != 0 && IsBlank(*at)) ++at;
    char* end = nullptr;
    const double number = std::strtod(at, &end);
    if (end == at || (*end != 0 && !IsBlank(*end))) return numbers;
    numbers.push_back(number);
    at = end;
  }
}

// True for attributes that are words even if they look like numbers.
bool IsWord(std::string_view attribute) {
  constexpr std::array<std::string_view, 17> kWords = {
      "name",   "class", "childclass", "mesh",  "material", "texture", "hfield", "joint", "joint1",
      "joint2", "body",  "body1",      "body2", "link",     "site",    "tendon", "target"};
  return std::ranges::find(kWords, attribute) != kWords.end() || attribute.starts_with("file");
}

// Width times height of the PNG at `path`; 0 for other files.
double PngCells(const fs::path& path) {
  std::array<unsigned char, 24> head{};
  std::ifstream file(path, std::ios::binary);
  if (!file.read(reinterpret_cast<char*>(head.data()), head.size())) return 0.0;
  constexpr std::string_view kPng = "\x89PNG\r\n\x1a\n";
  if (!std::equal(kPng.begin(), kPng.end(), head.begin(),
                  [](char a, unsigned char b) { return static_cast<unsigned char>(a) == b; })) {
    return 0.0;
  }
  const auto number = [&](std::size_t at) {
    return 256.0 * (256.0 * (256.0 * head[at] + head[at + 1]) + head[at + 2]) + head[at + 3];
  };
  return number(16) * number(20);
}

std::string_view KindName(fs::file_type kind) {
  switch (kind) {
    case fs::file_type::directory:
      return "a folder";
    case fs::file_type::fifo:
      return "a pipe";
    case fs::file_type::socket:
      return "a socket";
    default:
      return "a device";
  }
}

// Checks the file and its includes, each in one pass.
class RobotFileCheck {
 public:
  explicit RobotFileCheck(const fs::path& path) : path_(path) {
    folders_.push_back(fs::absolute(path).parent_path());
  }

  RobotFile Run() {
    RobotFile file;
    file.text = ReadText(path_);
    if (file.text.empty()) throw Error(path_.string(), "is empty", "Check the path");
    Scan(path_, file.text);
    // Later includes may add folders in which earlier names are found.
    for (std::size_t k = 0; k < named_.size(); ++k) {
      const Named named = named_[k];
      const std::optional<fs::path> found = Find(named);
      file.files.emplace_back(named.name, found.value_or(fs::path()));
      if (!found) continue;
      if (named.included && included_.insert(fs::weakly_canonical(*found)).second) {
        AddFolder(found->parent_path());
        Scan(*found, ReadText(*found));
      } else if (const double cells = PngCells(*found); cells > kMaxCells) {
        throw Error(found->string(),
                    fmt::format("is an image of {:.0f} million pixels, used by {}", 1e-6 * cells,
                                path_.string()),
                    "Make it smaller, or remove it: images are not used");
      }
    }
    return file;
  }

 private:
  struct Named {
    fs::path by;
    std::string name;
    bool included;
  };
  struct Open {
    std::string label;
    double copies;
  };

  std::string ReadText(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    if (!file) throw Error(path.string(), "cannot be read", "Check the path");
    std::error_code ignored;
    const std::uintmax_t size = fs::file_size(path, ignored);
    bytes_ += ignored ? 0 : static_cast<std::size_t>(std::min<std::uintmax_t>(size, kMaxBytes + 1));
    if (bytes_ > kMaxBytes) {
      throw Error(path.string(), "is larger than 64 MB with its includes", "Check the path");
    }
    std::string text(ignored ? 0 : static_cast<std::size_t>(size), '\0');
    file.read(text.data(), static_cast<std::streamsize>(text.size()));
    text.resize(static_cast<std::size_t>(file.gcount()));
    return text;
  }

  void Scan(const fs::path& path, const std::string& text) {
    std::vector<Open> open;
    XmlTags tags(text);
    XmlTag tag;
    while (tags.Next(tag)) {
      if (tag.closes) {
        if (!open.empty()) open.pop_back();
        continue;
      }
      const std::string label = Label(tag, open);
      const double copies = CopiesOf(path, tag, label, open.empty() ? 1.0 : open.back().copies);
      Count(path, tag, copies);
      CheckNumbers(path, tag, label);
      CheckSizes(path, tag, label);
      NoteFiles(path, tag);
      if (tag.empty) continue;
      open.push_back({label, copies});
      if (open.size() > kMaxDepth) {
        throw Error(path.string(), fmt::format("has elements nested deeper than {}", kMaxDepth),
                    "Check that the file describes a robot");
      }
    }
    if (tags.DefinesEntities()) {
      throw Error(path.string(), "defines XML entities, which are not supported",
                  "Replace them with their values");
    }
  }

  // "joint 'a'": the element, or the enclosing element that has a name.
  static std::string Label(const XmlTag& tag, const std::vector<Open>& open) {
    const std::string name = fmt::format("{:.60}", tag.Attribute("name"));
    if (!name.empty()) return fmt::format("{:.40} '{}'", tag.name, name);
    if (!open.empty() && open.back().label.find('\'') != std::string::npos) {
      return open.back().label;
    }
    return fmt::format("<{:.40}>", tag.name);
  }

  // Number of instances of the element: composites and similar elements are replicated.
  double CopiesOf(const fs::path& path, const XmlTag& tag, const std::string& label,
                  double around) const {
    if (tag.name != "composite" && tag.name != "replicate" && tag.name != "flexcomp") return around;
    double copies = around;
    for (const double count : LeadingNumbers(std::string(tag.Attribute("count")))) {
      copies *= std::max(1.0, count);
    }
    if (copies <= kMaxCopies) return copies;
    throw Error(path.string(),
                fmt::format("{}: a {} of {:.0f} parts; the maximum is {:.0f}", label, tag.name,
                            copies, kMaxCopies),
                "Leave it out of the hand's file, or lower its count");
  }

  void Count(const fs::path& path, const XmlTag& tag, double copies) {
    elements_ += copies;
    if (tag.name == "link" || tag.name == "body") links_ += copies;
    if (tag.attributes.size() > kMaxAttributes) {
      throw Error(path.string(),
                  fmt::format("<{:.40}> has more than {} attributes", tag.name, kMaxAttributes),
                  "Check that the file describes a robot");
    }
    if (elements_ > kMaxElements) {
      throw Error(path.string(), fmt::format("has more than {:.0f} elements", kMaxElements),
                  "Give the file of the hand alone");
    }
    if (links_ > kMaxLinks) {
      throw Error(path.string(), fmt::format("has more than {:.0f} links", kMaxLinks),
                  "Give the file of the hand alone");
    }
  }

  void CheckNumbers(const fs::path& path, const XmlTag& tag, const std::string& label) const {
    // urdfdom skips elements with such an origin and reports them.
    if (path_.extension() == ".urdf" && tag.name == "origin") return;
    for (const auto& [name, value] : tag.attributes) {
      if (IsWord(name)) continue;
      for (const double number : LeadingNumbers(value)) {
        if (std::isfinite(number)) continue;
        throw Error(path.string(),
                    fmt::format("{}: {}=\"{:.80}\" is not finite", label, name, value),
                    "Correct the number");
      }
    }
  }

  static double NumberOf(const XmlTag& tag, std::string_view name, double without) {
    const std::vector<double> numbers = LeadingNumbers(std::string(tag.Attribute(name)));
    return numbers.empty() ? without : numbers.front();
  }

  static void CheckSizes(const fs::path& path, const XmlTag& tag, const std::string& label) {
    double cells = 0.0;
    if (tag.name == "hfield") cells = NumberOf(tag, "nrow", 0.0) * NumberOf(tag, "ncol", 0.0);
    if (tag.name == "texture") {
      const double width = NumberOf(tag, "width", 0.0);
      cells = width * NumberOf(tag, "height", 6.0 * width);
    }
    if (std::abs(cells) > kMaxCells) {
      throw Error(path.string(), fmt::format("{}: {:.0f} million points", label, 1e-6 * cells),
                  "Leave it out of the hand's file, or make it smaller");
    }
    if (tag.name != "size") return;
    for (const auto& [name, value] : tag.attributes) {
      // MuJoCo does not allocate scratch memory of this size in advance.
      const bool scratch = name == "nstack" || name == "memory";
      const double most = name.starts_with("nuser_") ? kMaxUserNumbers : kMaxSize;
      for (const double number : LeadingNumbers(value)) {
        if (number <= (scratch ? 10.0 * kMaxSize : most)) continue;
        throw Error(path.string(),
                    fmt::format("<size {}=\"{:.40}\"> would take gigabytes", name, value),
                    "Remove it: a hand does not need that much memory");
      }
    }
  }

  void NoteFiles(const fs::path& path, const XmlTag& tag) {
    if (tag.name == "compiler") {
      for (const char* kind : {"meshdir", "texturedir", "assetdir"}) {
        const std::string_view folder = tag.Attribute(kind);
        if (!folder.empty()) AddFolder(folders_.front() / folder);
      }
      return;
    }
    for (const auto& [name, value] : tag.attributes) {
      if (!name.starts_with("file") || value.empty()) continue;
      const std::string file = value.starts_with("file://") ? value.substr(7) : value;
      if (!seen_.insert(file).second) continue;
      named_.push_back({path, file, tag.name == "include"});
      if (named_.size() <= kMaxFiles) continue;
      throw Error(path.string(), fmt::format("names more than {} files", kMaxFiles),
                  "Give the file of the hand alone");
    }
  }

  void AddFolder(const fs::path& folder) {
    if (std::ranges::find(folders_, folder) != folders_.end()) return;
    folders_.push_back(folder);
    if (folders_.size() <= kMaxFolders) return;
    throw Error(path_.string(), fmt::format("has its files in more than {} folders", kMaxFolders),
                "Put them into one");
  }

  // Resolves a name to a regular file. Throws Error if only something else is there.
  std::optional<fs::path> Find(const Named& named) const {
    if (named.name.starts_with("package://")) return std::nullopt;  // resolved by FindRobotMesh
    std::optional<std::pair<fs::path, fs::file_type>> irregular;
    for (const fs::path& folder : folders_) {
      for (const fs::path& tried :
           {folder / named.name, folder / fs::path(named.name).filename()}) {
        std::error_code ignored;
        const fs::file_type kind = fs::status(tried, ignored).type();
        if (kind == fs::file_type::regular) {
          if (fs::file_size(tried, ignored) <= kMaxNamedBytes) return tried;
          throw Error(tried.string(),
                      fmt::format("is larger than 512 MB, and {} names it", named.by.string()),
                      "Give the hand a smaller file");
        }
        const bool there = kind != fs::file_type::none && kind != fs::file_type::not_found &&
                           kind != fs::file_type::unknown;
        if (there && !irregular) irregular = {tried, kind};
      }
    }
    if (irregular) {
      throw Error(named.by.string(),
                  fmt::format("names '{}', and {} is {}", named.name, irregular->first.string(),
                              KindName(irregular->second)),
                  "Put a regular file there, or correct the name");
    }
    return std::nullopt;
  }

  const fs::path path_;
  std::vector<fs::path> folders_;  // search folders for names, the file's own folder first
  std::vector<Named> named_;
  std::set<fs::path> included_;
  std::set<std::string> seen_;  // names already seen
  std::size_t bytes_ = 0;
  double elements_ = 0.0, links_ = 0.0;
};

}  // namespace

std::string_view XmlTag::Attribute(std::string_view wanted) const {
  for (const auto& [key, value] : attributes) {
    if (key == wanted) return value;
  }
  return {};
}

// Skips past the next `after`; returns false if there is none.
bool XmlTags::Skip(std::string_view after) {
  const std::size_t found = text_.find(after, at_);
  if (found == std::string_view::npos) return false;
  at_ = found + after.size();
  return true;
}

bool XmlTags::Next(XmlTag& tag) {
  while ((at_ = text_.find('<', at_)) != std::string_view::npos) {
    const std::string_view rest = text_.substr(at_);
    tag.begin = at_;
    if (rest.starts_with("<!--")) {
      if (!Skip("-->")) return false;
    } else if (rest.starts_with("<![CDATA[")) {
      if (!Skip("]]>")) return false;
    } else if (rest.starts_with("<!")) {
      if (!Skip(">")) return false;
      const std::string_view all = text_.substr(tag.begin, at_ - tag.begin);
      defines_entities_ = defines_entities_ || all.find("<!ENTITY") != std::string_view::npos;
    } else if (rest.starts_with("<?")) {
      if (!Skip("?>")) return false;
    } else {
      ++at_;
      tag.closes = rest.starts_with("</");
      tag.empty = false;
      if (tag.closes) ++at_;
      const std::size_t end = std::min(text_.find_first_of(" \t\r\n/><", at_), text_.size());
      tag.name = text_.substr(at_, end - at_);
      tag.attributes.clear();
      at_ = end;
      return ReadAttributes(tag);
    }
  }
  return false;
}

bool XmlTags::ReadAttributes(XmlTag& tag) {
  while (at_ < text_.size()) {
    const char c = text_[at_];
    if (c == '>') {
      tag.end = ++at_;
      return true;
    }
    if (c == '/' && at_ + 1 < text_.size() && text_[at_ + 1] == '>') {
      tag.empty = !tag.closes;
      tag.end = at_ += 2;
      return true;
    }
    if (IsBlank(c) || c == '/' || c == '=' || c == '<') {
      ++at_;
      continue;
    }
    const std::size_t name = at_;
    at_ = std::min(text_.find_first_of(" \t\r\n/>=<\"'", at_), text_.size());
    std::string key(text_.substr(name, at_ - name));
    std::size_t value = std::min(text_.find_first_not_of(kBlanks, at_), text_.size());
    if (value < text_.size() && text_[value] == '=') {
      value = std::min(text_.find_first_not_of(kBlanks, value + 1), text_.size());
    }
    if (value == text_.size()) return false;
    if (const char quote = text_[value]; quote == '"' || quote == '\'') {
      const std::size_t end = text_.find(quote, value + 1);
      if (end == std::string_view::npos) return false;
      tag.attributes.emplace_back(std::move(key),
                                  Resolved(text_.substr(value + 1, end - value - 1)));
      at_ = end + 1;
    } else if (value > at_ && text_[value - 1] == '=') {
      at_ = std::min(text_.find_first_of(" \t\r\n>", value), text_.size());
      tag.attributes.emplace_back(std::move(key), Resolved(text_.substr(value, at_ - value)));
    }
  }
  return false;
}

RobotFile CheckRobotFile(const fs::path& path) { return RobotFileCheck(path).Run(); }

}  // namespace holdfast
