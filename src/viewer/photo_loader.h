// SPDX-License-Identifier: Apache-2.0
// Reads photographs beside the window's own thread.
#pragma once
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "ewa/dataset.h"
#include "viewer/picture.h"
#include "viewer/size.h"

namespace ewa::viewer {

struct Photo {
    int frame = -1;
    Picture picture;  // as its camera sees it, a whole factor smaller where that still covers twice the size
                      // asked for
    Size size;        // of the frame's camera
    std::string failure;  // one line, where there is no picture
};

class PhotoLoader {
  public:
    /// on_news is called on the thread when a photograph is there.
    explicit PhotoLoader(std::function<void()> on_news);
    ~PhotoLoader();

    /// The frame's photograph, for a place of this size; where it is transparent, over the background. The
    /// last one asked for replaces those that wait.
    void ask(int index, const Frame& frame, Size size, const std::array<float, 3>& background);
    /// The last one read, or null.
    std::shared_ptr<const Photo> photo() const;

  private:
    struct Request {
        int index = 0;
        Frame frame;
        Size size;
        std::array<float, 3> background{};
    };
    void work();

    std::function<void()> on_news_;
    mutable std::mutex mutex_;
    std::condition_variable wake_;
    std::optional<Request> waiting_;
    std::shared_ptr<const Photo> photo_;
    bool stop_ = false;
    std::thread thread_;
};

}  // namespace ewa::viewer
