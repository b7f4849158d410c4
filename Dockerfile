# The program and the Python module in Debian 12, from the packages that ./setup package makes:
#   docker build -t holdfast . && docker run --rm -v "$PWD:/work" holdfast fit demo_drink mug -o held
FROM debian:12-slim
COPY dist/*.deb /packages/
RUN apt-get update \
 && apt-get install -y --no-install-recommends \
      /packages/holdfast_*.deb /packages/python3-holdfast_*.deb \
 && rm -rf /packages /var/lib/apt/lists/*
# For GIF and MP4 of `holdfast render`: apt-get install ffmpeg, 130 MB more.
WORKDIR /work
ENTRYPOINT ["holdfast"]
