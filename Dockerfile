# evslip with its compiled functions ready: docs/how-to/install.md says how to build and run it.
ARG PYTHON=3.11

FROM python:${PYTHON}-slim AS build
WORKDIR /source
COPY pyproject.toml README.md LICENSE ./
COPY src src
RUN python -m pip wheel --no-cache-dir --no-deps --wheel-dir /wheel .

FROM python:${PYTHON}-slim
ARG EXTRAS=learn,control,view
ARG PIP_EXTRA_INDEX_URL
# Mitsuba (photo) and dv-processing (live) need libatomic, the fast variant of Mitsuba LLVM; all else is in the base.
RUN apt-get update && apt-get install --yes --no-install-recommends libatomic1 \
    && case ",$EXTRAS," in *,photo,*) apt-get install --yes --no-install-recommends libllvm19 ;; esac \
    && rm -rf /var/lib/apt/lists/*
COPY constraints.txt /opt/evslip/
COPY --from=build /wheel /opt/evslip/wheel
RUN python -m pip install --no-cache-dir -c /opt/evslip/constraints.txt \
    "evslip[$EXTRAS] @ file://$(ls /opt/evslip/wheel/*.whl)"
ENV MUJOCO_GL=disabled
# Machine code is kept beside the package and loaded from there by any user, on processors of the kind that built it.
RUN evslip warm-up complex && evslip demo /tmp/demo && rm -r /tmp/demo
RUN useradd --create-home evslip && install --directory --owner evslip /data
USER evslip
WORKDIR /data
ENTRYPOINT ["evslip"]
CMD ["demo", "demo"]
