// SPDX-License-Identifier: Apache-2.0
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <tuple>
#include <utility>

#include "arrays.h"
#include "bindings.h"
#include "capture/run_inputs.h"
#include "core/folders.h"
#include "core/json.h"
#include "core/text.h"
#include "core/typing.h"
#include "device.h"
#include "errors.h"
#include "ewa/evaluation.h"
#include "ewa/run_observer.h"
#include "ewa/splat_edit.h"
#include "ewa/trainer.h"
#include "folders/former_options.h"
#include "folders/run_folder.h"
#include "inputs.h"
#include "metrics.h"
#include "options.h"
#include "run/evaluation.h"
#include "run/first_checks.h"
#include "run/option_table.h"
#include "run/photo_background.h"
#include "run/resume.h"
#include "run/run_input.h"
#include "run/scout.h"
#include "train/checkpoint.h"
#include "train_options.h"

namespace ewa::python {
namespace {

using Json = nlohmann::ordered_json;

/// What a training begins with.
struct TrainerStart {
    SharedDataset dataset;
    std::optional<train::Masks> masks = {};  // of robust=True, where they are known
    RunOptions run = usual_options();        // with a concrete strategy and SH degree
    std::vector<int> frames = {};
    bool own_start = false;  // the first splats are an argument

    void resolve_options() {
        run.train = resolve(run.train, *dataset, frames);
        run.train.render.sh_degree = run.train.sh_degree;
    }
    /// The frames that are not trained on count as held out.
    Split split() const {
        Split all{frames, {}};
        for (int i = 0; i < int(dataset->frames.size()); ++i)
            if (std::find(frames.begin(), frames.end(), i) == frames.end()) all.test.push_back(i);
        return all;
    }
};

/// The argument init.
struct FirstSplats {
    const Splats* given = nullptr;
    std::string word = "sfm";  // without `given`: as RunOptions::init

    explicit FirstSplats(nb::handle init) {
        if (init.is_none()) return;
        if (nb::isinstance<Splats>(init)) {
            given = &nb::cast<const Splats&>(init);
            return;
        }
        std::filesystem::path path;
        if (!nb::try_cast(init, path)) throw nb::type_error("init is neither Splats nor a path");
        word = path.string();
        if (train::starts_by_word(word)) return;
        std::error_code ignored;
        if (!std::filesystem::exists(path, ignored))
            throw InputError(
                "init is neither splats nor \"sfm\", \"stereo\" or \"random\", and there is no file " +
                core::one_line(word));
        word = std::filesystem::absolute(capture::splat_input(path).file).string();
    }

    Gaussians splats(const TrainerStart& start) const {
        if (!given) {
            RunOptions run = start.run;
            run.init = word;
            return train::initial_splats(run, *start.dataset, start.frames);
        }
        Gaussians splats = given->gaussians;
        set_sh_degree(splats, start.run.train.sh_degree);
        return splats;
    }
};

/// A signal ends the scout of robust=True.
struct EndedBySignals : RunObserver {
    bool should_stop() override {
        check_signals();
        return false;
    }
};

/// Masks what single images show and the others do not. Finds the masks if they are not known. Returns why there are none, if so.
std::string leave_out_passers_by(TrainerStart& start, const Gaussians& splats, const DeviceWork& work) {
    train::RunInput input;
    input.options = start.run;
    input.dataset = *start.dataset;
    input.split = start.split();
    input.start = splats;
    EndedBySignals observer;
    const bool known = start.masks.has_value();
    const std::string note = train::leave_out_passers_by(work.device(), input, start.masks, &observer);
    start.masks = train::masks_of(input);
    const bool masked = std::ranges::any_of(*start.masks, [](const Image& mask) { return mask.width > 0; });
    auto kept = std::make_shared<std::pair<Dataset, SharedDataset>>(std::move(input.dataset), start.dataset);
    start.dataset = SharedDataset(kept, &kept->first);
    return known || masked ? "" : note;
}

/// What makes the training useless. Evaluations read the held-out images again, if there are any.
/// init: what the first splats are from, unless they are from the dataset.
std::vector<train::Finding> findings_of(const TrainerStart& start, const Gaussians& splats,
                                        const std::string& init) {
    std::vector<train::Finding> findings = train::check_images(*start.dataset, start.split(), false);
    const train::FirstPlaces places{splats.size(), [&](size_t i) { return splats.world_mean(i); }, init};
    for (const train::Finding& finding : train::check_start(*start.dataset, start.frames, places))
        findings.push_back(finding);
    return findings;
}

/// ewa.Trainer
class Training {
  public:
    Training(TrainerStart start, const FirstSplats& first) : start_(std::move(start)), word_(first.word) {
        start_.own_start = first.given;
        std::string unmasked;
        std::vector<train::Finding> findings;
        {
            const DeviceWork work;
            Gaussians splats = first.splats(start_);
            findings = findings_of(start_, splats,
                                   first.given                    ? "init"
                                   : train::starts_by_word(word_) ? ""
                                                                  : word_);
            if (start_.run.robust) unmasked = leave_out_passers_by(start_, splats, work);
            trainer_ = OnDevice(std::make_unique<Trainer>(work.device(), *start_.dataset, start_.frames,
                                                          std::move(splats), start_.run.train));
        }
        say_log();
        for (const train::Finding& finding : findings) warn(PyExc_UserWarning, spelled(finding.text.c_str()));
        if (!unmasked.empty()) warn(PyExc_UserWarning, spelled(unmasked.c_str()));
    }

    StepReport step() {
        const DeviceWork work;
        if (trainer_->steps_done() >= start_.run.train.steps)
            throw InputError("all " + core::counted(uint64_t(start_.run.train.steps), "step") + " are done");
        last_ = trainer_->step();
        return last_;
    }
    StepReport next() {
        if (last_.step >= start_.run.train.steps) throw nb::stop_iteration();
        return step();
    }

    Splats splats() const {
        const DeviceWork work;
        return {trainer_->gaussians(), start_.run.train.render.kernel == Footprint::antialias};
    }
    nb::ndarray<nb::numpy, float> exposures() const {
        std::vector<float> values;
        size_t count = 0;
        {
            const DeviceWork work;
            for (const Exposure& exposure : trainer_->exposures()) {
                values.insert(values.end(), exposure.begin(), exposure.end());
                ++count;
            }
        }
        return to_numpy(std::move(values), {count, 3, 4});
    }

    nb::ndarray<nb::numpy, float> sky() const {
        SkyMap map;
        {
            const DeviceWork work;
            if (const auto learned = trainer_->sky()) map = *learned;
        }
        const auto size = size_t(map.size);
        return to_numpy(std::move(map.texels), {size, size, 3});
    }

    void save_checkpoint(const std::filesystem::path& path) const {
        const std::string fingerprint =
            with_files([&] { return train::dataset_fingerprint(*start_.dataset, start_.split()); });
        Json settings = train::checkpoint_settings(start_.run, fingerprint);
        settings["cap"] = trainer_->max_splats();
        settings["fields"] = options_json(start_.run);
        settings["train_frames"] = start_.frames;
        settings["init"] = start_.own_start ? "splats" : word_;
        if (start_.masks) settings[train::kMasksSetting] = train::fingerprint_of(*start_.masks);
        TrainerState state = [this] {
            const DeviceWork work;
            return trainer_->state();
        }();
        const train::Checkpoint checkpoint{settings.dump(), "", last_.seconds, std::move(state)};
        with_new_file(path, [&] { train::write_checkpoint(path, checkpoint); });
    }
    void restore(const std::filesystem::path& path, const TrainerState& state) {
        const DeviceWork work;
        try {
            trainer_->restore(state);
        } catch (const InputError& error) {
            throw InputError(path.string() + ": " + error.what());
        }
        last_ = state.report;
    }

    const TrainerStart& start() const { return start_; }
    /// With what was chosen.
    RunOptions options() const {
        RunOptions all = start_.run;
        all.train.max_splats = trainer_->max_splats();
        all.train.final_splats = trainer_->final_splats();
        return all;
    }
    const StepReport& last() const { return last_; }

  private:
    TrainerStart start_;
    std::string word_;
    OnDevice<Trainer> trainer_;
    StepReport last_;
};

TrainerStart start_of(const LoadedDataset& dataset) {
    TrainerStart start{.dataset = dataset.dataset};
    start.run.downscale = dataset.options.downscale;
    return start;
}

void start_training(Training* self, const ObjectOrPath<LoadedDataset>& given, nb::handle init,
                    nb::handle train_frames, const std::optional<std::string>& quality,
                    const nb::kwargs& options) {
    const Opened<LoadedDataset> dataset(given, open_dataset);
    TrainerStart start = start_of(*dataset);
    if (quality)
        start.run.train.steps =
            of_argument("quality", [&] { return core::value_of(train::kQualities, *quality); });
    for (const auto& [name, value] : options) set_option(start.run, nb::cast<std::string>(name), value);
    start.frames = train_frames.is_none() ? split_frames(*dataset->dataset, dataset->test_every).train
                                          : frames_of(train_frames, *dataset->dataset, "train_frames");
    check_options(start.run);
    const FirstSplats first(init);
    const bool from_points = !first.given && first.word == "sfm";
    if (!from_points && start.run.train.halvings == kAutomaticHalvings) start.run.train.halvings = 0;
    train::choose_background(start.run, *start.dataset, start.frames);
    start.resolve_options();
    new (self) Training(std::move(start), first);
}

/// The options and the training frames that a checkpoint was written with, of this package or of ewa train.
void read_settings(const Json& settings, TrainerStart& start) {
    if (!settings.is_object()) throw InputError("its settings cannot be read");
    if (settings.contains("fields")) {
        read_options(settings["fields"], start.run);
        const Json frames = settings.value("train_frames", Json::array());
        for (const Json& frame : frames)
            if (frame.is_number_unsigned() && frame.get<uint64_t>() < start.dataset->frames.size())
                start.frames.push_back(frame.get<int>());
        return;
    }
    RunOptions run = usual_options();
    const Json stored = folders::with_present_names(settings.value("options", Json::object()));
    for (const train::RunOption& option : train::run_options()) {
        if (!option.decides_result || !stored.contains(option.name)) continue;
        const Json& value = stored[option.name];
        option.set(run, value.is_string() ? value.get<std::string>() : value.dump());
    }
    if (run.skip_blurred)
        throw InputError(
            "was written with --skip-blurred, which Python does not have; ewa train --resume continues it");
    if (run.rolling_shutter)
        throw InputError(
            "was written with --rolling-shutter, which Python does not have; ewa train --resume continues "
            "it");
    start.run.train = run.train;
    start.run.robust = run.robust;
    start.run.dense_start = run.dense_start;
    start.run.init_opacity = run.init_opacity;
    start.run.init_scale = run.init_scale;
    start.frames = split_frames(*start.dataset, run.test_every).train;
}

/// Why a checkpoint does not continue with this dataset.
std::string other_dataset(const Json& settings, const TrainerStart& start) {
    const Json options = settings.value("options", Json());
    const Json then = options.is_object() ? options.value("downscale", Json()) : Json();
    if (then.is_number_unsigned() && then.get<uint64_t>() != uint64_t(start.run.downscale))
        return "its images had downscale=" + then.dump() +
               ", and those of this Dataset have downscale=" + std::to_string(start.run.downscale);
    return "is of another dataset, or its images or cameras have changed";
}

/// The masks of a checkpoint with this fingerprint of them: none, or those that ewa train wrote beside it. Empty: they are to be found
/// again.
std::optional<train::Masks> known_masks(const std::filesystem::path& checkpoint, const TrainerStart& start,
                                        const Json& fingerprint) {
    train::Masks none(start.frames.size());
    if (fingerprint == train::fingerprint_of(none)) return none;
    train::RunInput input;
    input.options.output = checkpoint.parent_path();
    if (!core::is_folder(input.options.output / folders::kPassersByFolder)) return std::nullopt;
    input.dataset = *start.dataset;
    input.split = start.split();
    return train::saved_masks(input);
}

Training resume(const std::filesystem::path& named, const ObjectOrPath<LoadedDataset>& given, nb::handle init,
                std::optional<int> steps) {
    const auto path = core::is_folder(named) ? named / folders::kCheckpointFile : named;
    const train::Checkpoint checkpoint = with_files([&] { return train::read_checkpoint(path); });
    const Opened<LoadedDataset> dataset(given, open_dataset);
    TrainerStart start = start_of(*dataset);
    Json settings;
    try {
        settings = core::parse_json<Json>(checkpoint.settings, "its settings");
        read_settings(settings, start);
    } catch (const InputError& error) {
        throw InputError(path.string() + ": " + error.what());
    }
    if (settings.value("dataset", Json()) != train::dataset_fingerprint(*dataset->dataset, start.split()))
        throw InputError(path.string() + ": " + other_dataset(settings, start));
    const Json begun = settings.value("init", Json("sfm"));
    if (begun == "splats" && init.is_none())
        throw InputError(path.string() + ": its training began with splats; pass them again as init");
    RunOptions& run = start.run;
    if (steps) run.train.steps = *steps;
    train::continue_from(path, checkpoint, RunOptions(run), run);
    start.resolve_options();
    const nb::object first =
        init.is_none() ? nb::cast(begun.is_string() ? begun.get<std::string>() : "sfm") : nb::borrow(init);
    if (run.robust)
        start.masks = with_files(
            [&] { return known_masks(path, start, settings.value(train::kMasksSetting, Json())); });
    Training training(std::move(start), FirstSplats(first));
    const auto& masks = training.start().masks;
    if (masks && settings.value(train::kMasksSetting, Json()) != train::fingerprint_of(*masks))
        throw InputError(path.string() + ": its masks of robust=True are not those that are found now");
    training.restore(path, checkpoint.state);
    return training;
}

/// Adds figures with these names to each frame, and their means to the evaluation.
void add_figures(Evaluation& evaluation, const std::vector<std::string>& names,
                 const std::vector<std::vector<Figure>>& of_frames) {
    const size_t first = evaluation.figures.size(), count = of_frames.size();
    for (const std::string& name : names)
        evaluation.figures.push_back({name, count == 0 ? std::nan("") : 0.0});
    for (size_t i = 0; i < count; ++i)
        for (size_t k = 0; k < names.size(); ++k) {
            evaluation.frames[i].figures.push_back(of_frames[i][k]);
            evaluation.figures[first + k].value += of_frames[i][k].value / double(count);
        }
}

Evaluation evaluate_splats(const ObjectOrPath<Splats>& given_splats,
                           const ObjectOrPath<LoadedDataset>& given_dataset, nb::handle frames,
                           nb::handle metrics, nb::handle background, std::optional<std::string> kernel,
                           const std::string& integrator, std::optional<int> samples, bool points,
                           std::optional<int> nearest) {
    const AskedMetrics asked = asked_metrics(metrics);
    const Opened<LoadedDataset> dataset(given_dataset, open_dataset);
    const Opened<Splats> splats(given_splats, open_splats);
    std::vector<int> chosen = frames.is_none() ? split_frames(*dataset->dataset, dataset->test_every).test
                                               : frames_of(frames, *dataset->dataset, "frames");
    if (chosen.empty()) throw InputError("frames is empty: there is nothing to evaluate");
    RenderOptions options = look_of({std::move(kernel), integrator, samples, points, nearest}, *splats);
    if (background.is_none())
        options.background = dataset->background;
    else
        use_background(options, background);
    Gaussians fitted;
    const Gaussians& gaussians = fitted_to(options.kernel, *splats, fitted);
    std::vector<std::vector<Figure>> lpips;  // of each view
    const auto on_view = [&](size_t, const train::RenderedView& view, const EvalFrame&) {
        lpips.push_back(lpips_figures(asked.lpips, view.rendering, view.photo, view.weights));
    };
    check(*dataset->dataset, chosen);
    const DeviceWork work;
    Evaluation evaluation =
        train::evaluate_views(train::view_renderer_of(work.device(), gaussians, options), *dataset->dataset,
                              chosen, options, {}, check_signals, on_view, {.meter = asked.meter});
    add_figures(evaluation, asked.lpips, lpips);
    return evaluation;
}

std::string report_text(const StepReport& report) {
    return "StepReport(step=" + std::to_string(report.step) + ", loss=" + std::to_string(report.loss) +
           ", splats=" + std::to_string(report.splats) + ")";
}

/// Pickles an object of which `fields` makes a tuple, and `made` the object again.
template <class Class, class Fields, class Made>
void bind_pickle(Class& bound, Fields fields, Made made) {
    using Object = typename Class::Type;
    using State = decltype(fields(std::declval<const Object&>()));
    bound.def(
        "__getstate__", [=](const Object& object) { return fields(object); },
        nb::sig("def __getstate__(self) -> tuple[object, ...]"));
    bound.def(
        "__setstate__",
        [=](Object& object, const State& state) { new (&object) Object(std::apply(made, state)); },
        nb::sig("def __setstate__(self, state: tuple[object, ...], /) -> None"));
}

void bind_results(nb::module_& module) {
    auto report =
        nb::class_<StepReport>(module, "StepReport", "What a step of a training did.")
            .def_ro("step", &StepReport::step, "Steps done.")
            .def_ro("seconds", &StepReport::seconds, "In steps so far.")
            .def_ro("loss", &StepReport::loss,
                    "Of the last step that the device has finished; a GPU may be one behind.")
            .def_ro("psnr", &StepReport::psnr, "dB, of the image that loss is of.")
            .def_ro("splats", &StepReport::splats)
            .def_ro("dropped_updates", &StepReport::dropped_updates, "Updates so far that were not finite.")
            .def_ro("skipped_nonfinite", &StepReport::skipped_nonfinite,
                    "Splats skipped in the last step: a value is not finite.")
            .def_ro("limited_steps", &StepReport::limited_steps, "Updates so far that were shortened.")
            .def("__repr__", report_text);
    bind_pickle(
        report,
        [](const StepReport& r) {
            return std::tuple(r.step, r.seconds, r.loss, r.splats, r.dropped_updates, r.skipped_nonfinite,
                              r.limited_steps, r.psnr);
        },
        [](const auto&... values) { return StepReport{values...}; });
    auto frame =
        nb::class_<EvalFrame>(module, "EvalFrame", "How close the render of a frame is to its image.")
            .def_ro("name", &EvalFrame::name)
            .def_ro("psnr", &EvalFrame::psnr, "dB")
            .def_ro("ssim", &EvalFrame::ssim)
            .def_prop_ro(
                "metrics", [](const EvalFrame& f) { return figures_dict(f.psnr, f.ssim, f.figures); },
                nb::for_getter(nb::sig("def metrics(self) -> dict[str, float]")),
                "All that was measured, under the names of docs/figures.md.")
            .def("__repr__", [](const EvalFrame& f) {
                return "EvalFrame('" + f.name + "', psnr=" + std::to_string(f.psnr) +
                       ", ssim=" + std::to_string(f.ssim) + ")";
            });
    bind_pickle(
        frame, [](const EvalFrame& f) { return std::tuple(f.name, f.psnr, f.ssim, pickled(f.figures)); },
        [](std::string name, double psnr, double ssim, const FigureState& figures) {
            return EvalFrame{
                .name = std::move(name), .psnr = psnr, .ssim = ssim, .figures = figures_of(figures)};
        });
    auto evaluation =
        nb::class_<Evaluation>(module, "Evaluation", "How close renders are to a dataset's images.")
            .def_ro("psnr", &Evaluation::psnr, "dB, the mean over the frames.")
            .def_ro("ssim", &Evaluation::ssim, "The mean over the frames.")
            .def_prop_ro(
                "metrics", [](const Evaluation& e) { return figures_dict(e.psnr, e.ssim, e.figures); },
                nb::for_getter(nb::sig("def metrics(self) -> dict[str, float]")),
                "The means of all that was measured, under the names of docs/figures.md.")
            .def_ro("frames", &Evaluation::frames)
            .def_ro("seconds", &Evaluation::seconds)
            .def("__repr__", [](const Evaluation& e) {
                return "Evaluation(psnr=" + std::to_string(e.psnr) + ", ssim=" + std::to_string(e.ssim) +
                       ", " + core::counted(e.frames.size(), "frame") + ")";
            });
    bind_pickle(
        evaluation,
        [](const Evaluation& e) {
            return std::tuple(e.psnr, e.ssim, pickled(e.figures), e.frames, e.seconds);
        },
        [](double psnr, double ssim, const FigureState& figures, std::vector<EvalFrame> frames,
           double seconds) {
            return Evaluation{.psnr = psnr,
                              .ssim = ssim,
                              .figures = figures_of(figures),
                              .frames = std::move(frames),
                              .seconds = seconds};
        });
}

void bind_trainer(nb::module_& module) {
    using namespace nb::literals;
    const std::string init =
        "def __init__(self, dataset: " EWA_DATASET_TYPE
        ", *, init: Splats | typing.Literal['sfm', 'stereo', 'random'] | str | os.PathLike[str] | None = "
        "None, train_frames: collections.abc.Sequence[int] | None = None, "
        "quality: typing.Literal['low', 'medium', 'high'] | None = None" +
        option_parameters() + ") -> None";
    nb::class_<Training>(
        module, "Trainer",
        "Trains splats on the images of a dataset. Iterating takes the steps: for report in trainer.")
        .def(
            "__init__", start_training, "dataset"_a, nb::kw_only(), "init"_a = nb::none(),
            "train_frames"_a = nb::none(), "quality"_a = nb::none(), "options"_a, nb::sig(init.c_str()),
            "init: the first splats, a file of splats or points, or the folder of a run; \"sfm\", the "
            "usual, takes the dataset's points. "
            "train_frames: all but every eighth frame unless given. quality: low is 2000 steps, medium 7000, "
            "high the usual 30000; steps goes before it. docs/training_options.md explains the other "
            "options.")
        .def(
            "__iter__", [](nb::handle self) { return nb::borrow(self); },
            nb::sig("def __iter__(self) -> Trainer"))
        .def("__next__", &Training::next)
        .def("step", &Training::step,
             "Takes one step. Ctrl-C takes effect after it; the trainer can go on or be saved then.")
        .def("splats", &Training::splats, "The splats after the last step.")
        .def("exposures", &Training::exposures,
             nb::sig("def exposures(self) -> numpy.typing.NDArray[numpy.float32]"),
             "[m, 3, 4], the affine map of colours for each training frame; empty unless "
             "appearance=\"affine\".")
        .def("sky", &Training::sky, nb::sig("def sky(self) -> numpy.typing.NDArray[numpy.float32]"),
             "[n, n, 3], the sky that render() and evaluate() take as background; empty unless "
             "background=\"sky\".")
        .def("save_checkpoint", &Training::save_checkpoint, "path"_a,
             "Writes all that later steps depend on. A file is replaced as a whole. Raises OSError.")
        .def_static(
            "resume", resume, "path"_a, "dataset"_a, nb::kw_only(), "init"_a = nb::none(),
            "steps"_a = nb::none(),
            nb::sig("def resume(path: str | os.PathLike[str], dataset: " EWA_DATASET_TYPE
                    ", *, init: Splats | str | os.PathLike[str] | None = None, steps: int | None = None) -> "
                    "Trainer"),
            "Continues from a checkpoint of this class or of ewa train, or from that of a run's folder, with "
            "its options. On the same device "
            "the bytes are "
            "those of an uninterrupted training. init: the splats that the training began with, if it was "
            "given some. "
            "steps: another number of steps. Raises InputError.")
        .def_prop_ro("steps", [](const Training& t) { return t.start().run.train.steps; })
        .def_prop_ro("steps_done", [](const Training& t) { return t.last().step; })
        .def_prop_ro("train_frames", [](const Training& t) { return t.start().frames; })
        .def_prop_ro(
            "options", [](const Training& t) { return options_dict(t.options()); },
            nb::for_getter(nb::sig("def options(self) -> dict[str, object]")),
            "All options, with the strategy, the SH degree and the cap of splats that were chosen.")
        .def("__repr__", [](const Training& t) {
            return "Trainer(" + std::to_string(t.last().step) + " of " +
                   core::counted(uint64_t(t.start().run.train.steps), "step") + ")";
        });
}

}  // namespace

void bind_train(nb::module_& module) {
    using namespace nb::literals;
    bind_results(module);
    bind_trainer(module);
    module.attr("_argument_names") = argument_names();
    module.attr("_value_words") = value_words();
    module.def("evaluate", evaluate_splats, "splats"_a, "dataset"_a, "frames"_a = nb::none(), nb::kw_only(),
               "metrics"_a = nb::tuple(), "background"_a = nb::none(), "kernel"_a = nb::none(),
               "integrator"_a = "splat", "samples"_a = nb::none(), "points"_a = false,
               "nearest"_a = nb::none(),
               nb::sig("def evaluate(splats: " EWA_SPLATS_TYPE ", dataset: " EWA_DATASET_TYPE
                       ", frames: collections.abc.Sequence[int] | None = None, *, "
                       "metrics: str | collections.abc.Sequence[str] = (), "
                       "background: numpy.typing.ArrayLike | str | None = None, " EWA_LOOK_TYPES ") "
                       "-> Evaluation"),
               "Renders frames and compares each with its image: every eighth frame unless given, those that "
               "Trainer leaves "
               "out. metrics: names of docs/figures.md that are measured beside PSNR and SSIM; \"all\" names "
               "all but LPIPS. background: that of the run that dataset is, else black, unless given. Ctrl-C "
               "ends it.");
}

}  // namespace ewa::python
