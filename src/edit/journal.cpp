// SPDX-License-Identifier: Apache-2.0
#include "edit/journal.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <utility>

#include "core/folders.h"
#include "core/json_field.h"
#include "ewa/error.h"

namespace ewa::edit {
namespace {

using Json = nlohmann::ordered_json;

constexpr uint64_t kFormat = 1;
constexpr uintmax_t kMostBytes = 256u << 20;

std::string head_line(const JournalHead& head) {
    return Json{{"ewa_edits", kFormat}, {"file", head.file}, {"splats", head.splats}}.dump();
}

std::string step_line(const Step& step) {
    Json edits = Json::array();
    for (const Words& words : step.edits)
        edits.push_back(words.value.empty() ? Json{words.name} : Json{words.name, words.value});
    return Json{{"step", step.title}, {"edits", std::move(edits)}}.dump();
}

/// where: the file and the line, for errors.
Step step_of(const core::JsonField& line) {
    Step step{line.text("step"), {}};
    for (const nlohmann::json& item : line.list("edits")) {
        const bool texts = item.is_array() && !item.empty() && item.size() <= 2 && item.front().is_string() &&
                           item.back().is_string();
        if (!texts) throw InputError(line.where() + ": an edit is not a list of its name and its value");
        step.edits.push_back(
            {item.front().get<std::string>(), item.size() == 2 ? item.back().get<std::string>() : ""});
    }
    return step;
}

/// Steps as a history has them: undone ones stay until another step is done.
struct Replayed {
    std::vector<Step> steps;
    size_t done = 0;

    void take(const core::JsonField& line) {
        if (line.has("undo")) {
            if (done == 0) throw InputError(line.where() + ": there is nothing to undo");
            --done;
        } else if (line.has("redo")) {
            if (done == steps.size()) throw InputError(line.where() + ": there is nothing to redo");
            ++done;
        } else {
            steps.resize(done);
            steps.push_back(step_of(line));
            ++done;
        }
    }
};

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

ReadJournal read_journal(const std::filesystem::path& file) {
    const std::string text = whole_text(file);
    ReadJournal journal;
    Replayed replayed;
    size_t number = 0;
    for (size_t begin = 0; begin < text.size();) {
        const size_t end = text.find('\n', begin);
        if (end == std::string::npos) break;  // cut off
        const std::string where = file.string() + ": line " + std::to_string(++number);
        const core::JsonField line =
            core::JsonField::of_text(std::string_view(text).substr(begin, end - begin), where);
        begin = end + 1;
        if (number > 1) {
            replayed.take(line);
            continue;
        }
        if (line.whole("ewa_edits", UINT32_MAX) != kFormat)
            throw InputError(where + ": written by a later version of ewa-view");
        journal.head = {line.text("file"), size_t(line.whole("splats", UINT32_MAX))};
    }
    if (number == 0) throw InputError(file.string() + ": no journal of edits: its first line is missing");
    replayed.steps.resize(replayed.done);
    journal.steps = std::move(replayed.steps);
    return journal;
}

std::vector<Edit> edits_of_journal(const std::filesystem::path& file) {
    std::vector<Edit> edits;
    for (const Step& step : read_journal(file).steps)
        for (const Words& words : step.edits) try {
                edits.push_back(parse(words.name, words.value));
            } catch (const InputError& error) {
                throw InputError(file.string() + ": " + error.what());
            }
    return edits;
}

std::filesystem::path journal_of(const std::filesystem::path& file) {
    return file.string() + ".edits";
}

struct Journal::File {
    std::FILE* stream = nullptr;
    ~File() {
        if (stream) std::fclose(stream);
    }
};

Journal::Journal(std::filesystem::path file, const JournalHead& head, bool go_on)
    : file_(std::move(file)), open_(std::make_unique<File>()) {
    uintmax_t whole = 0;
    if (go_on) {
        // A line that a crash has cut off would join the next one.
        const size_t end = whole_text(file_).rfind('\n');
        whole = end == std::string::npos ? 0 : end + 1;
        std::filesystem::resize_file(file_, whole);
    }
    open_->stream = std::fopen(file_.c_str(), whole > 0 ? "ab" : "wb");
    if (!open_->stream) throw RunError(file_.string() + ": " + std::strerror(errno));
    if (whole == 0) append(head_line(head));
}

Journal::~Journal() = default;

void Journal::append(const std::string& line) {
    if (!open_->stream) return;
    const std::string text = line + '\n';
    if (std::fwrite(text.data(), 1, text.size(), open_->stream) != text.size() ||
        std::fflush(open_->stream) != 0)
        throw RunError(file_.string() + ": cannot be written: " + std::strerror(errno));
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

void Journal::remove() {
    open_ = std::make_unique<File>();
    std::error_code ignored;
    std::filesystem::remove(file_, ignored);
}

}  // namespace ewa::edit
