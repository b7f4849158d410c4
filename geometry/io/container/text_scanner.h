// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace holdfast {

/// Walks over whitespace-separated words of a text and knows on which line it stands, so that every
/// complaint can name file and line. Any line ending. Holds a view: the text must outlive it.
class TextScanner {
 public:
  /// `name` goes before the line number in messages; lines after `comment` (when not 0) are skipped
  /// from that character on.
  TextScanner(std::string name, std::string_view text, char comment = '\0');

  bool AtEnd();                   ///< true when only blanks and comments are left
  std::string_view Peek();        ///< next word, empty at the end; does not move
  std::string_view Next();        ///< next word, empty at the end
  std::string_view PeekOnLine();  ///< next word if it stands on the current line, else empty
  std::string_view RestOfLine();  ///< up to the line's end, blanks trimmed

  /// Next word as a finite number; throws Error ("expected <what>, found ...").
  double Number(std::string_view what);
  /// Next word as a whole number in [lowest, highest]; throws Error.
  int Integer(std::string_view what, int lowest, int highest);
  /// Next word must be `word` (letter case ignored); throws Error.
  void Expect(std::string_view word, std::string_view context);

  int Line() const { return line_; }  ///< of the word last read, from 1
  std::string Where() const;          ///< "name:line"
  [[noreturn]] void Fail(std::string_view problem, std::string_view remedy) const;

 private:
  std::string_view WordAt(std::size_t position) const;
  void SkipBlanks(std::size_t& position, int& line, bool stay_on_line) const;

  std::string name_;
  std::string_view text_;
  char comment_;
  std::size_t position_ = 0;
  int line_ = 1;
};

/// A text as the scanner reads it: UTF-16 with or without a byte order mark becomes UTF-8, carriage
/// returns that alone end lines become line feeds. `notes` is told of both, and of a byte order
/// mark. Bytes that are no such text come back as they are.
std::string PlainText(std::string bytes, std::vector<std::string>& notes);

/// True when two words are equal apart from the case of ASCII letters.
bool EqualIgnoringCase(std::string_view a, std::string_view b);

/// The word as a number, nothing when it is not one in full. Accepts a leading '+' and infinities.
bool ParseNumber(std::string_view word, double& value);

}  // namespace holdfast
