// SPDX-License-Identifier: Apache-2.0
// Trains a dataset for a number of steps: train DATASET FOLDER STEPS [STOP]
//
// With STOP the run ends after that step, and the same command without STOP resumes it.
#include <ewa/error.h>
#include <ewa/run.h>
#include <cstdio>
#include <cstdlib>

namespace {

class Printer : public ewa::RunObserver {
  public:
    explicit Printer(int last_step) : last_step_(last_step) {}
    bool should_stop() override { return last_step_ > 0 && step_ >= last_step_; }
    void on_note(const std::string& line) override { std::printf("%s\n", line.c_str()); }
    void on_step(const ewa::StepReport& report) override { step_ = report.step; }
    void on_evaluation(int step, const ewa::Evaluation& evaluation) override {
        std::printf("step %d: PSNR %.2f dB\n", step, evaluation.psnr);
    }

  private:
    int last_step_, step_ = 0;
};

}  // namespace

int main(int argc, char** argv) {
    if (argc != 4 && argc != 5) {
        std::fprintf(stderr, "train DATASET FOLDER STEPS [STOP]\n");
        return 2;
    }
    try {
        ewa::RunOptions options;
        options.dataset = argv[1];
        options.output = argv[2];
        options.downscale = 2;
        options.train.steps = std::atoi(argv[3]);
        options.resume = true;
        Printer printer(argc == 5 ? std::atoi(argv[4]) : 0);
        const ewa::RunResult result = ewa::run_training(options, printer);
        std::printf("%s after %d steps, %u splats\n", result.summary.interrupted ? "stopped" : "done",
                    result.summary.steps, result.summary.splats);
        return 0;
    } catch (const ewa::InputError& error) {
        std::fprintf(stderr, "train: %s\n", error.what());
        return 2;
    } catch (const ewa::RunError& error) {
        std::fprintf(stderr, "train: %s\n", error.what());
        return 1;
    }
}
