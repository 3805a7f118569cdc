// SPDX-License-Identifier: Apache-2.0
// A file of edits, one line of JSON for each step, undo and redo. The window writes it beside the splats. ewa convert --edits replays
// it.
#pragma once
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "edit/history.h"

namespace ewa::edit {

/// What the first line says about the file that is edited.
struct JournalHead {
    std::string file;  // its name, without folders
    size_t splats = 0;
    bool operator==(const JournalHead&) const = default;
};

struct ReadJournal {
    JournalHead head;
    std::vector<Step> steps;  // without those that were undone or dropped
};

/// Reads a journal. A last line that is cut off, as after a crash, is skipped. Throws InputError with the number of the line.
ReadJournal read_journal(const std::filesystem::path& file);

/// The edits of a journal, parsed, for apply(). Throws InputError with the file's name.
std::vector<Edit> edits_of_journal(const std::filesystem::path& file);

/// The journal of a splat file: FILE.edits beside it.
std::filesystem::path journal_of(const std::filesystem::path& file);

/// Appends to a journal. Every line is on the disk (flushed to the kernel) when the call returns.
class Journal {
  public:
    /// Creates the file with its first line, or continues one that has the same head. Throws RunError.
    Journal(std::filesystem::path file, const JournalHead& head, bool go_on);
    ~Journal();
    void did(const Step& step);
    void undid();
    void redid();
    /// Closes and removes the file: nothing is left to save.
    void remove();
    const std::filesystem::path& file() const { return file_; }

  private:
    void append(const std::string& line);
    struct File;
    std::filesystem::path file_;
    std::unique_ptr<File> open_;
};

}  // namespace ewa::edit
