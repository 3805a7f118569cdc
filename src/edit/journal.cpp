// SPDX-License-Identifier: Apache-2.0
#include "edit/journal.h"

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <utility>

#include "core/folders.h"
#include "core/json_field.h"
#include "core/text.h"
#include "core/typing.h"
#include "ewa/error.h"
#include "platform/file.h"
#include "platform/file_facts.h"

namespace ewa::edit {
namespace {

using Json = nlohmann::ordered_json;

constexpr uint64_t kFormat = 1;
constexpr uintmax_t kMostBytes = 256u << 20;

/// Names of files may be no UTF-8.
std::string line_of(const Json& json) {
    return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string head_line(const JournalHead& head) {
    Json json{{"ewa_edits", kFormat}, {"file", head.file}, {"splats", head.splats}};
    if (!head.time.empty()) {
        json["bytes"] = head.bytes;
        json["time"] = head.time;
    }
    return line_of(json);
}

std::string step_line(const Step& step) {
    Json edits = Json::array();
    for (const Words& words : step.edits)
        edits.push_back(words.value.empty() ? Json{words.name} : Json{words.name, words.value});
    return line_of(Json{{"step", step.title}, {"edits", std::move(edits)}});
}

Edit parsed(const Words& words) {
    Edit edit = parse(words.name, words.value);
    const auto row = std::ranges::find(rows(), std::string_view(words.name), &Row::name);
    if (!words.value.empty() && row != rows().end() && *row->value == 0)
        throw InputError("--" + words.name + " takes no value");
    return edit;
}

Step step_of(const core::JsonField& line) {
    Step step{line.text("step"), {}};
    for (const nlohmann::json& item : line.list("edits")) {
        const bool texts = item.is_array() && !item.empty() && item.size() <= 2 && item.front().is_string() &&
                           item.back().is_string();
        if (!texts) throw InputError(line.where() + ": an edit is not a list of its name and its value");
        step.edits.push_back(
            {item.front().get<std::string>(), item.size() == 2 ? item.back().get<std::string>() : ""});
        try {
            parsed(step.edits.back());
        } catch (const InputError& error) {
            throw InputError(line.where() + ": " + error.what());
        }
    }
    return step;
}

/// Steps as a history has them: undone ones stay until another step is done.
struct Replayed {
    ReadJournal journal;
    size_t done = 0;

    void take(const core::JsonField& line) {
        std::vector<Step>& steps = journal.steps;
        if (line.has("undo")) {
            if (done == journal.separated) throw InputError(line.where() + ": there is nothing to undo");
            --done;
        } else if (line.has("redo")) {
            if (done == steps.size()) throw InputError(line.where() + ": there is nothing to redo");
            ++done;
        } else if (line.has("saved")) {
            journal.saved = lasting_edits({steps.data(), done});
        } else if (line.has("separated")) {
            journal.separated = done;
            journal.separated_at = size_t(line.whole("separated", UINT32_MAX));
        } else {
            steps.resize(done);
            steps.push_back(step_of(line));
            ++done;
        }
    }
};

JournalHead read_head(const core::JsonField& line) {
    if (line.whole("ewa_edits", UINT32_MAX) != kFormat)
        throw InputError(line.where() + ": written by a later version of ewa-view");
    JournalHead head{line.text("file"), size_t(line.whole("splats", UINT32_MAX))};
    head.time = line.text("time", "");
    if (!head.time.empty()) head.bytes = line.whole("bytes", uint64_t(1) << 53);
    return head;
}

std::string whole_text(const std::filesystem::path& file) {
    std::error_code error;
    const uintmax_t bytes = std::filesystem::file_size(file, error);
    if (error || !core::is_file(file)) throw InputError(file.string() + ": no such file");
    if (bytes > kMostBytes)
        throw InputError(file.string() + ": larger than 256 MiB, which no journal of edits is");
    std::ifstream stream(file, std::ios::binary);
    std::ostringstream text;
    text << stream.rdbuf();
    if (!stream) throw InputError(file.string() + ": cannot be read");
    return text.str();
}

}  // namespace

JournalHead head_of(const std::filesystem::path& file, size_t splats) {
    JournalHead head{file.filename().string(), splats};
    std::error_code error;
    const auto time = platform::write_time(file, error);
    if (error) return head;
    head.bytes = std::filesystem::file_size(file, error);
    if (!error) head.time = std::to_string(time.time_since_epoch().count());
    return head;
}

bool same_version(const JournalHead& head, const JournalHead& file) {
    return head.splats == file.splats &&
           (head.time.empty() || (head.time == file.time && head.bytes == file.bytes));
}

ReadJournal read_journal(const std::filesystem::path& file) {
    const std::string text = whole_text(file);
    Replayed replayed;
    ReadJournal& journal = replayed.journal;
    size_t number = 0;
    bool headed = false;
    for (size_t begin = 0; begin < text.size();) {
        const size_t end = std::min(text.find('\n', begin), text.size());
        const std::string_view words = std::string_view(text).substr(begin, end - begin);
        begin = end + 1;
        ++number;
        if (core::trim(words).empty()) continue;
        if (end == text.size()) {
            journal.cut_off = true;
            break;
        }
        const core::JsonField line =
            core::JsonField::of_text(words, file.string() + ": line " + std::to_string(number));
        if (std::exchange(headed, true))
            replayed.take(line);
        else
            journal.head = read_head(line);
    }
    if (!headed) throw InputError(file.string() + ": no journal of edits: its first line is missing");
    journal.steps.resize(replayed.done);
    return std::move(replayed.journal);
}

std::vector<Edit> edits_of_journal(const std::filesystem::path& file) {
    std::vector<Edit> edits;
    for (const Words& words : edits_of(read_journal(file).steps)) edits.push_back(parsed(words));
    return edits;
}

std::vector<std::string> journal_remarks(const std::filesystem::path& file, size_t splats) {
    const ReadJournal journal = read_journal(file);
    std::vector<std::string> remarks;
    if (journal.cut_off)
        remarks.push_back("--edits: the last line of " + file.string() + " is cut off and skipped");
    if (journal.head.splats != splats)
        remarks.push_back("--edits: these edits were made on " + core::counted(journal.head.splats, "splat") +
                          ", and the scene has " + std::to_string(splats));
    return remarks;
}

std::filesystem::path journal_of(const std::filesystem::path& file, size_t part) {
    std::string name = file.string();
    if (part >= 2) name.append(".").append(std::to_string(part));
    return name + ".edits";
}

void set_aside(const std::filesystem::path& journal) {
    std::error_code ignored;
    std::filesystem::rename(journal, journal.string() + ".before", ignored);
}

/// The open file, locked. File systems without locks open it too.
struct Journal::File : platform::File {
    File(const std::filesystem::path& file, platform::Open how) {
        if (const auto error = open(file, how))
            throw RunError(core::one_line(file.string()) + ": " + error.message());
        if (try_lock() == platform::Lock::taken) throw RunError("another window edits this file");
    }
};

bool in_use(const std::filesystem::path& journal) {
    return platform::is_locked(journal);
}

Journal::Journal(std::filesystem::path file, const JournalHead& head, bool go_on)
    : file_(std::move(file)), open_(std::make_unique<File>(file_, platform::Open::edit)) {
    const std::string text = whole_text(file_);
    if (go_on) {
        // A line that a crash has cut off would join the next one.
        whole_ = text.rfind('\n') + 1;  // npos + 1 is 0
        std::filesystem::resize_file(file_, whole_);
        if (const auto error = open_->go_to(whole_))
            throw RunError(core::one_line(file_.string()) + ": " + error.message());
    } else if (!text.empty()) {
        set_aside(file_);
        open_ = std::make_unique<File>(file_, platform::Open::create);
    }
    if (whole_ == 0) append(head_line(head));
}

Journal::~Journal() = default;

void Journal::append(const std::string& line) {
    if (!open_ || broken_) return;
    const std::string text = line + '\n';
    if (const auto error = open_->write(text.data(), text.size())) {
        broken_ = true;
        std::error_code ignored;
        if (whole_ == 0)
            std::filesystem::remove(file_, ignored);
        else
            std::filesystem::resize_file(file_, whole_, ignored);
        throw RunError(core::one_line(file_.string()) + " cannot be written: " + error.message());
    }
    whole_ += text.size();
}

void Journal::did(const Step& step) {
    append(step_line(step));
}

void Journal::undid() {
    append(R"({"undo":1})");
}

void Journal::redid() {
    append(R"({"redo":1})");
}

void Journal::separated(size_t at) {
    append("{\"separated\":" + std::to_string(at) + "}");
}

void Journal::saved() {
    if (broken_) return remove();
    append(R"({"saved":1})");
}

void Journal::remove() {
    if (!std::exchange(open_, nullptr)) return;
    std::error_code ignored;
    std::filesystem::remove(file_, ignored);
}

}  // namespace ewa::edit
