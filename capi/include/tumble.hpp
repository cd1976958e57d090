/* tumble.hpp: the handles of tumble.h as C++ objects that free themselves, and results as exceptions. C++11 and later. */
#ifndef TUMBLE_HPP
#define TUMBLE_HPP

#include "tumble.h"

#include <memory>
#include <stdexcept>

namespace tumble {

/* A call that failed; `result` is its reason, and `what()` the message of tumble_last_error. */
struct Error : std::runtime_error {
    explicit Error(TumbleResult reason) : std::runtime_error(tumble_last_error()), result(reason) {}
    TumbleResult result;
};

/* Throws unless the call succeeded: tumble::check(tumble_set_new(...)). */
inline void check(TumbleResult result) {
    if (result != TUMBLE_RESULT_OK) throw Error(result);
}

/* Frees each type of handle. A destructor has no caller for an error; the library keeps its message. */
struct Free {
    void operator()(TumbleEngine *it) const { (void)tumble_engine_free(it); }
    void operator()(TumbleSet *it) const { (void)tumble_set_free(it); }
    void operator()(TumbleFile *it) const { (void)tumble_file_free(it); }
    void operator()(TumbleClip *it) const { (void)tumble_clip_free(it); }
    void operator()(TumbleSampler *it) const { (void)tumble_sampler_free(it); }
    void operator()(TumbleClipTarget *it) const { (void)tumble_clip_target_free(it); }
    void operator()(TumbleTimedTarget *it) const { (void)tumble_timed_target_free(it); }
    void operator()(TumblePassTarget *it) const { (void)tumble_pass_target_free(it); }
    void operator()(TumbleCrowdLibrary *it) const { (void)tumble_crowd_library_free(it); }
    void operator()(TumbleCrowd *it) const { (void)tumble_crowd_free(it); }
    void operator()(TumbleCrowdTarget *it) const { (void)tumble_crowd_target_free(it); }
};

/* A handle that is freed at the end of its scope: tumble::Handle<TumbleSet> set = tumble::make(tumble_set_new). */
template <typename T> using Handle = std::unique_ptr<T, Free>;

namespace detail {
template <typename F> struct Made;
template <typename... A> struct Made<TumbleResult (*)(A...)>;
template <typename T> struct Made<TumbleResult (*)(T **)> { using Type = T; };
template <typename A, typename... R> struct Made<TumbleResult (*)(A, R...)> : Made<TumbleResult (*)(R...)> {};
} // namespace detail

/* Calls a function whose last argument takes a new handle: tumble::make(tumble_engine_open, "cpu", nullptr). */
template <typename F, typename... A> Handle<typename detail::Made<F>::Type> make(F function, A... arguments) {
    typename detail::Made<F>::Type *made = nullptr;
    check(function(arguments..., &made));
    return Handle<typename detail::Made<F>::Type>(made);
}

} // namespace tumble

#endif
