// SPDX-License-Identifier: Apache-2.0
#include "cli/program.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <numbers>
#include <sstream>
#include <stdexcept>
#include <thread>

#include "core/random.h"
#include "ewa/image.h"
#include "ewa/splat_files.h"

namespace ewa::test {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void become(const std::string& program, const std::vector<std::string>& arguments,
                         const std::string& out, const std::string& err, const Circumstances& circumstances) {
    const size_t file_limit = circumstances.file_limit;
    for (const auto& [name, value] : circumstances.environment) setenv(name.c_str(), value.c_str(), 1);
    dup2(open(out.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600), STDOUT_FILENO);
    dup2(open(err.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600), STDERR_FILENO);
    dup2(open("/dev/null", O_RDONLY), STDIN_FILENO);
    // Ignored where the tests run in the background of a script, or under nohup.
    std::signal(SIGINT, SIG_DFL);
    std::signal(SIGQUIT, SIG_DFL);
    std::signal(SIGHUP, circumstances.nohup ? SIG_IGN : SIG_DFL);
    const rlimit no_core{0, 0};
    setrlimit(RLIMIT_CORE, &no_core);
    if (file_limit > 0) {
        // Ignored, so that the write fails with EFBIG as it would with ENOSPC.
        std::signal(SIGXFSZ, SIG_IGN);
        const rlimit limit{file_limit, file_limit};
        setrlimit(RLIMIT_FSIZE, &limit);
    }
    if (circumstances.address_limit > 0) {
        const rlimit limit{circumstances.address_limit, circumstances.address_limit};
        setrlimit(RLIMIT_AS, &limit);
    }
    std::vector<char*> argv{const_cast<char*>(program.c_str())};
    for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
    argv.push_back(nullptr);
    execv(program.c_str(), argv.data());
    _exit(127);
}

/// Sends it, and waits until the program, has taken it: a second one would not be told from it.
void send(pid_t child, int signal) {
    kill(child, signal);
    const std::string status = "/proc/" + std::to_string(child) + "/status";
    for (bool pending = true; pending;) {
        pending = false;
        std::ifstream lines(status);
        for (std::string line; std::getline(lines, line);)
            if (line.starts_with("State:") && line.find('Z') != std::string::npos)
                return;
            else if (line.starts_with("SigPnd:") || line.starts_with("ShdPnd:"))
                pending |= std::stoull(line.substr(7), nullptr, 16) >> (signal - 1) & 1;
        if (pending) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
}

bool has_bytes(const std::string& path) {
    std::error_code error;
    const auto size = fs::file_size(path, error);
    return !error && size > 0;
}

/// Without what the counters of a coverage build say where a full disk, or none for them, stops them too, and without what Wine
/// says of its own threads while a program ends.
std::string without_noise(const std::string& text) {
    std::istringstream lines(text);
    std::string kept;
    for (std::string line; std::getline(lines, line);)
        if (!line.starts_with("libgcov profiling error:") && !line.starts_with("profiling:") &&
            !line.starts_with("wine client error:"))
            kept += line + (lines.eof() ? "" : "\n");
    return kept;
}

int wait_for(pid_t child, const Circumstances& circumstances) {
    bool signalled = circumstances.signal == 0 && !circumstances.then;
    int status = 0;
    while (true) {
        const pid_t ended = waitpid(child, &status, signalled ? 0 : WNOHANG);
        if (ended == child) break;
        if (!signalled && has_bytes(circumstances.await_file)) {
            for (int i = 0; i < circumstances.times && circumstances.signal != 0; ++i)
                send(child, circumstances.signal);
            if (circumstances.then) circumstances.then();
            signalled = true;
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

/// Camera to world in the OpenGL convention that transforms.json has: looks along -z, y up.
nlohmann::json looking_at_origin(const glm::dvec3& position) {
    const glm::dvec3 back = glm::normalize(position);
    const glm::dvec3 right = glm::normalize(glm::cross(glm::dvec3(0, 0, 1), back));
    const glm::dvec3 up = glm::cross(back, right);
    nlohmann::json matrix = nlohmann::json::array();
    for (int i = 0; i < 3; ++i) matrix.push_back({right[i], up[i], back[i], position[i]});
    matrix.push_back({0, 0, 0, 1});
    return matrix;
}

Image disc(int width, int height, double shade) {
    Image image(width, height, 3);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const bool inside = std::hypot(x + 0.5 - width / 2.0, y + 0.5 - height / 2.0) < height * 0.3;
            image.at(x, y)[0] = inside ? 0.9f : 0.1f;
            image.at(x, y)[1] = inside ? float(shade) : 0.1f;
            image.at(x, y)[2] = 0.2f;
        }
    return image;
}

}  // namespace

Outcome run_ewa(const std::vector<std::string>& arguments, const Circumstances& circumstances) {
    const Folder folder;
    const std::string out = circumstances.out_path.empty() ? folder / "out" : circumstances.out_path;
    const std::string err = circumstances.err_path.empty() ? folder / "err" : circumstances.err_path;
    const char* tested = std::getenv("EWA_TESTED_PROGRAM");
    const std::string ewa = tested ? tested : EWA_PROGRAM;
    const std::string program = circumstances.program.empty() ? ewa : circumstances.program;
    const pid_t child = fork();
    if (child < 0) throw std::runtime_error("fork failed");
    if (child == 0) become(program, arguments, out, err, circumstances);
    Outcome outcome;
    outcome.status = wait_for(child, circumstances);
    if (circumstances.out_path.empty()) outcome.out = read_file(out);
    if (circumstances.err_path.empty()) outcome.err = without_noise(read_file(err));
    if (tested)  // may be a program for Windows, whose paths have other separators
        for (std::string* text : {&outcome.out, &outcome.err})
            std::replace(text->begin(), text->end(), '\\', '/');
    return outcome;
}

void make_dataset(const std::string& folder, const std::vector<std::string>& names) {
    constexpr int kWidth = 48, kHeight = 32;
    nlohmann::json frames = nlohmann::json::array();
    for (size_t i = 0; i < names.size(); ++i) {
        const double angle = 2 * std::numbers::pi * double(i) / double(names.size());
        const fs::path file = fs::path(folder) / "images" / names[i];
        fs::create_directories(file.parent_path());
        save_image(file, disc(kWidth, kHeight, double(i) / double(names.size())));
        frames.push_back(
            {{"file_path", "images/" + names[i]},
             {"transform_matrix", looking_at_origin({4 * std::cos(angle), 4 * std::sin(angle), 1.0})}});
    }
    const nlohmann::json json = {{"w", kWidth},        {"h", kHeight},        {"fl_x", 50},      {"fl_y", 50},
                                 {"cx", kWidth / 2.0}, {"cy", kHeight / 2.0}, {"frames", frames}};
    fs::create_directories(folder);
    write_file(folder + "/transforms.json", json.dump(1));
}

void make_splats(const std::string& path, int count, int sh_degree) {
    Gaussians splats;
    splats.sh_degree = sh_degree;
    splats.resize(size_t(count));
    for (size_t i = 0; i < size_t(count); ++i) {
        const auto place = core::normal3({1, 2, uint32_t(i), 0});
        const auto look = core::uniform4({1, 2, uint32_t(i), 1});
        for (size_t k = 0; k < 3; ++k) {
            splats.means[3 * i + k] = float(0.5 * place[k]);
            splats.log_scales[3 * i + k] = -2.0f;
            splats.sh[splats.sh_stride() * i + k] = float(look[k] - 0.5);
        }
        splats.quaternions[4 * i] = 1;
        splats.opacity_logits[i] = 1;
    }
    save_splats(path, splats);
}

void write_file(const std::string& path, const std::string& bytes) {
    std::ofstream(path, std::ios::binary) << bytes;
}

std::string read_file(const std::string& path) {
    return file_bytes(path);
}

nlohmann::json read_json(const std::string& path) {
    return nlohmann::json::parse(read_file(path));
}

std::vector<std::string> files_below(const std::string& folder) {
    std::vector<std::string> files;
    for (const auto& entry : fs::recursive_directory_iterator(folder))
        if (entry.is_regular_file()) files.push_back(fs::relative(entry.path(), folder).string());
    std::sort(files.begin(), files.end());
    return files;
}

}  // namespace ewa::test
