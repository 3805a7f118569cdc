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
    uint64_t bytes = 0;     // the size of the file
    std::string time = {};  // of its last change, ns; empty: time and size are not known
    bool operator==(const JournalHead&) const = default;
};

/// The head for a file of so many splats, as it is on the disk now.
JournalHead head_of(const std::filesystem::path& file, size_t splats);

/// Whether the edits of a journal with the head `head` are of this version of the file. What the head does not know fits.
bool same_version(const JournalHead& head, const JournalHead& file);

struct ReadJournal {
    JournalHead head;
    std::vector<Step> steps;  // without those that were undone or dropped
    /// Of a scene that was separated from another one: the steps that undo leaves, and the other one's step. Else 0.
    size_t separated = 0, separated_at = 0;
    std::vector<Words> saved;  // lasting_edits() of the last save
    bool cut_off = false;      // a last line without its end was skipped
    bool unsaved() const { return lasting_edits(steps) != saved; }
};

/// Reads a journal. A last line that is cut off, as after a crash, is skipped. Throws InputError with the number of the line.
ReadJournal read_journal(const std::filesystem::path& file);

/// The edits of a journal, parsed, for apply(). Throws InputError with the number of the line.
std::vector<Edit> edits_of_journal(const std::filesystem::path& file);

/// What a user should know who replays the journal on a scene of so many splats.
std::vector<std::string> journal_remarks(const std::filesystem::path& file, size_t splats);

inline constexpr size_t kMostParts = 99;

/// The journal of a splat file: FILE.edits beside it. That of its part 2, which was separated: FILE.2.edits; up to kMostParts.
std::filesystem::path journal_of(const std::filesystem::path& file, size_t part = 1);

/// Renames a journal to FILE.before.
void set_aside(const std::filesystem::path& journal);

/// Whether a Journal of any process has the file open.
bool in_use(const std::filesystem::path& journal);

/// Appends to a journal, and locks it. Every line is on the disk (flushed to the kernel) when the call returns.
class Journal {
  public:
    /// Creates the file with its first line, and sets one aside that is there. go_on: continues it instead. Throws RunError, also
    /// if the file is in use.
    Journal(std::filesystem::path file, const JournalHead& head, bool go_on);
    ~Journal();

    // These throw RunError once if a line cannot be written. The file then keeps its whole lines, and gets no more.
    void did(const Step& step);
    void undid();
    void redid();
    void separated(size_t at);  // by this step of the other scene; undo stops here
    void saved();               // removes a file that misses lines

    /// Closes and removes the file: nothing is left to save.
    void remove();
    const std::filesystem::path& file() const { return file_; }

  private:
    void append(const std::string& line);
    struct File;
    std::filesystem::path file_;
    std::unique_ptr<File> open_;
    uint64_t whole_ = 0;  // bytes of whole lines
    bool broken_ = false;
};

}  // namespace ewa::edit
