// SPDX-License-Identifier: Apache-2.0
// ewa bench: time per pass, error against the CPU reference, and error against run time.
#include "bench/bench.h"

#include <CLI/CLI.hpp>
#include <memory>

#include "cli/accuracy.h"
#include "cli/command.h"
#include "ewa/error.h"
#include "ewa/splat_files.h"

namespace ewa::cli {

Action add_bench(CLI::App& app) {
    const auto options = std::make_shared<bench::Options>();
    bench::add_options(app, *options);
    const auto accuracy = std::make_shared<AccuracyArguments>();
    const auto wanted = std::make_shared<bool>(false);
    app.add_flag("--accuracy", *wanted,
                 "Error against run time on the dataset FILE: of rendering, against the integral along each "
                 "ray, and of training with each strategy for --training-steps (600)");
    app.add_option("--splats", accuracy->splats,
                   "With --accuracy: render this scene instead of the trained one")
        ->type_name("FILE");
    app.add_option("--svg", accuracy->svg,
                   "With --accuracy: write the diagram of rendering to FILE, and that of training to "
                   "NAME_training.svg beside it")
        ->type_name("FILE");
    options->read_splats = load_splats;
    const CLI::Option* steps = app.get_option("--training-steps");
    return [options, accuracy, wanted, steps] {
        if (!*wanted) return bench::run(*options, {"/proc/self/exe", "bench"});
        if (options->scene.empty())
            throw InputError("--accuracy needs a DATASET: ewa bench --accuracy DATASET");
        accuracy->dataset = options->scene;
        accuracy->json = options->json;
        accuracy->device = {.selector = options->device};
        if (steps->count() > 0) accuracy->steps = options->training_steps;
        return run_accuracy(*accuracy);
    };
}

}  // namespace ewa::cli
