/*
 * A double of a V4L2 driver, for measuring camera_node where there is no camera.
 *
 *     cc -shared -fPIC -o v4l2_double.so v4l2_double.c -ldl
 *     LD_PRELOAD=./v4l2_double.so V4L2_DOUBLE=/dev/full PROGRAM
 *
 * What the program opens as V4L2_DOUBLE, which has to be some character device, becomes a camera:
 * YUYV of 320x240, 640x480 or 1280x720 at the rate asked for, each frame carrying its number as
 * depth_person.camera.pattern draws it, and stamped with the monotonic clock. Frames for which no
 * buffer is queued are lost, as with a real driver.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <linux/videodev2.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/timerfd.h>
#include <time.h>
#include <unistd.h>

enum { MOST_BUFFERS = 8, BUFFER_STRIDE = 1 << 24, BITS = 24 };

static const int SIZES[][2] = {{320, 240}, {640, 480}, {1280, 720}};
static const int64_t SECOND_NS = 1000000000;

/* A buffer: its memory, and the frame that it holds. */
struct slot {
  unsigned char *memory;
  unsigned number;
  int64_t taken_ns;
};

static struct {
  int fd, width, height, fps, streaming;
  struct slot slots[MOST_BUFFERS];
  int empty[MOST_BUFFERS], empties;   /* queued by the program, oldest first */
  int filled[MOST_BUFFERS], fills;    /* waiting to be taken by it, oldest first */
  unsigned number;
  int64_t next_ns;
  int exposure_mode, exposure, gain;
} camera = {.fd = -1, .width = 640, .height = 480, .fps = 30, .exposure_mode = 3, .exposure = 100};

#define NEXT(result, name, ...) \
  static result (*next)(__VA_ARGS__); \
  if (!next) next = (result(*)(__VA_ARGS__))dlsym(RTLD_NEXT, #name)

static int64_t now_ns(void)
{
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * SECOND_NS + now.tv_nsec;
}

static void draw(unsigned char *image, unsigned number)
{
  memset(image, 128, (size_t)camera.width * camera.height * 2);
  for (int y = 0; y < camera.height / 16 * 2; y++) {
    for (int x = 0; x < camera.width; x++) {
      int bit = number >> (x * BITS / camera.width) & 1;
      int bright = y < camera.height / 16 ? bit : !bit;
      image[(y * camera.width + x) * 2] = bright ? 235 : 16;
    }
  }
}

static int pop(int *queue, int *length)
{
  int first = queue[0];
  memmove(queue, queue + 1, --*length * sizeof *queue);
  return first;
}

/* Let the driver do what it would have done until now. */
static void advance(void)
{
  for (; camera.streaming && now_ns() >= camera.next_ns; camera.number++) {
    if (camera.empties) {
      int index = pop(camera.empty, &camera.empties);
      camera.slots[index].number = camera.number;
      camera.slots[index].taken_ns = camera.next_ns;
      draw(camera.slots[index].memory, camera.number);
      camera.filled[camera.fills++] = index;
    }
    camera.next_ns += SECOND_NS / camera.fps;
  }
}

/* The descriptor is a timer's, so that select and poll wake when a frame may have come. */
static void tick(int64_t first_ns)
{
  struct itimerspec when = {{0, SECOND_NS / camera.fps}, {0, first_ns}};
  timerfd_settime(camera.fd, 0, &when, NULL);
}

static int open_camera(void)
{
  camera.fd = timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK);
  tick(1);
  return camera.fd;
}

static int is_camera(const char *path)
{
  const char *name = getenv("V4L2_DOUBLE");
  return name && path && !strcmp(path, name);
}

static int stop(void)
{
  camera.streaming = camera.empties = camera.fills = 0;
  return 0;
}

static int refuse(int error)
{
  errno = error;
  return -1;
}

static int query_capability(struct v4l2_capability *answer)
{
  memset(answer, 0, sizeof *answer);
  strcpy((char *)answer->driver, "v4l2_double");
  answer->device_caps = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
  answer->capabilities = answer->device_caps | V4L2_CAP_DEVICE_CAPS;
  return 0;
}

static int format(struct v4l2_format *wish, int change)
{
  struct v4l2_pix_format *pix = &wish->fmt.pix;
  if (wish->type != V4L2_BUF_TYPE_VIDEO_CAPTURE) return refuse(EINVAL);
  for (size_t i = 0; change && i < sizeof SIZES / sizeof *SIZES; i++) {
    if ((int)pix->width == SIZES[i][0] && (int)pix->height == SIZES[i][1]) {
      camera.width = pix->width;
      camera.height = pix->height;
    }
  }
  pix->width = camera.width;
  pix->height = camera.height;
  pix->pixelformat = V4L2_PIX_FMT_YUYV;
  pix->field = V4L2_FIELD_NONE;
  pix->bytesperline = 2 * camera.width;
  pix->sizeimage = 2 * camera.width * camera.height;
  return 0;
}

static int rate(struct v4l2_streamparm *wish, int change)
{
  struct v4l2_fract *period = &wish->parm.capture.timeperframe;
  if (change && period->numerator) camera.fps = period->denominator / period->numerator;
  wish->parm.capture.capability = V4L2_CAP_TIMEPERFRAME;
  period->numerator = 1;
  period->denominator = camera.fps;
  return 0;
}

static int request_buffers(struct v4l2_requestbuffers *wish)
{
  if (wish->count > MOST_BUFFERS) wish->count = MOST_BUFFERS;
  for (unsigned i = 0; i < wish->count; i++) {
    if (!camera.slots[i].memory) camera.slots[i].memory = malloc(1280 * 720 * 2);
  }
  camera.empties = camera.fills = 0;
  return 0;
}

static int query_buffer(struct v4l2_buffer *buffer)
{
  buffer->length = 2 * camera.width * camera.height;
  buffer->m.offset = buffer->index * BUFFER_STRIDE;
  return 0;
}

static int queue(struct v4l2_buffer *buffer)
{
  advance();
  camera.empty[camera.empties++] = buffer->index;
  return 0;
}

static int dequeue(struct v4l2_buffer *buffer)
{
  uint64_t ticks;
  if (read(camera.fd, &ticks, sizeof ticks) < 0 && errno != EAGAIN) return -1;
  advance();
  if (!camera.fills) return refuse(EAGAIN);
  buffer->index = pop(camera.filled, &camera.fills);
  struct slot *slot = &camera.slots[buffer->index];
  buffer->length = buffer->bytesused = 2 * camera.width * camera.height;
  buffer->timestamp.tv_sec = slot->taken_ns / SECOND_NS;
  buffer->timestamp.tv_usec = slot->taken_ns % SECOND_NS / 1000;
  buffer->sequence = slot->number;
  buffer->flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  if (camera.fills) tick(1);
  return 0;
}

static int *control(unsigned id)
{
  return id == V4L2_CID_EXPOSURE_AUTO       ? &camera.exposure_mode
         : id == V4L2_CID_EXPOSURE_ABSOLUTE ? &camera.exposure
         : id == V4L2_CID_GAIN              ? &camera.gain
                                            : NULL;
}

static int query_control(struct v4l2_queryctrl *query)
{
  if (!control(query->id)) return refuse(EINVAL);
  query->minimum = 0;
  query->maximum = 10000;
  query->step = 1;
  query->flags = 0;
  return 0;
}

static int use_control(struct v4l2_control *wish, int change)
{
  int *value = control(wish->id);
  if (!value) return refuse(EINVAL);
  if (change) *value = wish->value;
  wish->value = *value;
  return 0;
}

static int answer(unsigned request, void *argument)
{
  switch (request) {
    case VIDIOC_QUERYCAP: return query_capability(argument);
    case VIDIOC_ENUMINPUT: return ((struct v4l2_input *)argument)->index ? refuse(EINVAL) : 0;
    case VIDIOC_G_INPUT: case VIDIOC_S_INPUT: return *(int *)argument = 0;
    case VIDIOC_G_FMT: case VIDIOC_TRY_FMT: return format(argument, 0);
    case VIDIOC_S_FMT: return format(argument, 1);
    case VIDIOC_G_PARM: return rate(argument, 0);
    case VIDIOC_S_PARM: return rate(argument, 1);
    case VIDIOC_REQBUFS: return request_buffers(argument);
    case VIDIOC_QUERYBUF: return query_buffer(argument);
    case VIDIOC_QBUF: return queue(argument);
    case VIDIOC_DQBUF: return dequeue(argument);
    case VIDIOC_STREAMON:
      camera.streaming = 1;
      camera.number = 0;
      camera.next_ns = now_ns() + SECOND_NS / camera.fps;
      return 0;
    case VIDIOC_STREAMOFF: return stop();
    case VIDIOC_QUERYCTRL: return query_control(argument);
    case VIDIOC_G_CTRL: return use_control(argument, 0);
    case VIDIOC_S_CTRL: return use_control(argument, 1);
    default: return refuse(ENOTTY);
  }
}

int open(const char *path, int flags, ...)
{
  NEXT(int, open, const char *, int, ...);
  va_list rest;
  va_start(rest, flags);
  int mode = va_arg(rest, int);
  va_end(rest);
  return is_camera(path) ? open_camera() : next(path, flags, mode);
}

int open64(const char *path, int flags, ...)
{
  NEXT(int, open64, const char *, int, ...);
  va_list rest;
  va_start(rest, flags);
  int mode = va_arg(rest, int);
  va_end(rest);
  return is_camera(path) ? open_camera() : next(path, flags, mode);
}

void *mmap(void *address, size_t length, int protection, int flags, int fd, off_t offset)
{
  NEXT(void *, mmap, void *, size_t, int, int, int, off_t);
  if (fd >= 0 && fd == camera.fd) return camera.slots[offset / BUFFER_STRIDE].memory;
  return next(address, length, protection, flags, fd, offset);
}

void *mmap64(void *address, size_t length, int protection, int flags, int fd, off64_t offset)
{
  NEXT(void *, mmap64, void *, size_t, int, int, int, off64_t);
  if (fd >= 0 && fd == camera.fd) return camera.slots[offset / BUFFER_STRIDE].memory;
  return next(address, length, protection, flags, fd, offset);
}

int munmap(void *address, size_t length)
{
  NEXT(int, munmap, void *, size_t);
  for (int i = 0; i < MOST_BUFFERS; i++) {
    if (address && address == camera.slots[i].memory) return 0;
  }
  return next(address, length);
}

int close(int fd)
{
  NEXT(int, close, int);
  if (fd >= 0 && fd == camera.fd) {
    camera.fd = -1;
    stop();
  }
  return next(fd);
}

int ioctl(int fd, unsigned long request, ...)
{
  NEXT(int, ioctl, int, unsigned long, ...);
  va_list rest;
  va_start(rest, request);
  void *argument = va_arg(rest, void *);
  va_end(rest);
  if (fd >= 0 && fd == camera.fd) return answer((unsigned)request, argument);
  return next(fd, request, argument);
}
