//! Decodes the columns of a Parquet file.

use std::sync::Arc;

use arrow_schema::DataType;
use bytemuck::Pod;
use bytes::Bytes;
use parquet::arrow::ProjectionMask;
use parquet::arrow::arrow_reader::{ArrowReaderMetadata, ParquetRecordBatchReaderBuilder};
use parquet::basic::Type;
use parquet::column::reader::ColumnReaderImpl;
use parquet::data_type::{DoubleType, FloatType, Int64Type};
use parquet::file::serialized_reader::SerializedPageReader;
use parquet::schema::types::SchemaDescriptor;
use rayon::prelude::*;

use crate::diagnostic::Diagnostic;
use crate::parquet::pages::chunk;
use crate::parquet::{damaged, plain};
use crate::table::arrays::{Gather, chosen};
use crate::table::columns::{Column, ColumnNumbers, ColumnValues, RequestedColumn, Table};

/// Number of rows that are decoded at once.
const BATCH: usize = 1 << 16;

/// Fewer numbers than this are unpacked faster by one thread.
const MIN_PARALLEL_NUMBERS: usize = 1 << 16;

/// A file whose pages have been checked.
pub(super) struct ParquetFile<'a> {
    pub(super) name: &'a str,
    pub(super) bytes: Bytes,
    pub(super) metadata: ArrowReaderMetadata,
}

/// A column with its type.
type TypedColumn<'a> = (&'a RequestedColumn, &'a DataType);

impl ParquetFile<'_> {
    /// Reads all columns, one batch of rows after another.
    ///
    /// # Errors
    /// The first error.
    pub(super) fn read_together(
        &self,
        requested: &[TypedColumn<'_>],
        mut gather: Gather,
    ) -> Result<Table, Diagnostic> {
        let mut roots: Vec<usize> = requested.iter().map(|(column, _)| column.index).collect();
        roots.sort_unstable();
        roots.dedup();
        let damaged = |error: &dyn std::fmt::Display| damaged(self.name, error);
        let mask = ProjectionMask::roots(self.metadata.parquet_schema(), roots.iter().copied());
        let (bytes, metadata) = (self.bytes.clone(), self.metadata.clone());
        let batches = ParquetRecordBatchReaderBuilder::new_with_metadata(bytes, metadata)
            .with_projection(mask)
            .with_batch_size(BATCH)
            .build()
            .map_err(|error| damaged(&error))?;
        let indices = requested
            .iter()
            .map(|(column, _)| roots.partition_point(|&root| root < column.index));
        let indices: Vec<usize> = indices.collect();
        for batch in batches {
            let batch = batch.map_err(|error| damaged(&error))?;
            let columns =
                chosen(&batch, &indices).ok_or_else(|| damaged(&"a column is not there"))?;
            gather.push(&columns, batch.num_rows())?;
        }
        gather.finish()
    }

    /// Reads columns of plain numbers separately, directly into their lists, and the other columns together; on all
    /// threads if there are many numbers. `None` if anything is invalid or missing.
    pub(super) fn read_apart(&self, requested: &[TypedColumn<'_>]) -> Option<Table> {
        let schema = self.metadata.parquet_schema();
        // For each column, the index of its first leaf.
        let mut leaves = vec![None; schema.root_schema().get_fields().len()];
        for leaf in 0..schema.num_columns() {
            let first_leaf = leaves.get_mut(schema.get_column_root_idx(leaf))?;
            first_leaf.get_or_insert(leaf);
        }
        let plain = |(column, data_type): &TypedColumn<'_>| {
            let leaf = leaves.get(column.index).copied().flatten()?;
            is_plain(schema, leaf, data_type).then_some(leaf)
        };
        let leaves: Vec<Option<usize>> = requested.iter().map(plain).collect();
        let others = requested
            .iter()
            .zip(&leaves)
            .filter(|(_, leaf)| leaf.is_none());
        let others: Vec<TypedColumn<'_>> = others.map(|(column, _)| *column).collect();
        let plain: Vec<usize> = leaves.iter().copied().flatten().collect();
        let read_others = || {
            let gather = Gather::new(self.name, others.iter().copied()).ok()?;
            match &*others {
                [] => Some(Vec::new()),
                others => Some(self.read_together(others, gather).ok()?.columns),
            }
        };
        let rows = self.metadata.metadata().file_metadata().num_rows();
        let is_small =
            usize::try_from(rows).ok()?.saturating_mul(requested.len()) < MIN_PARALLEL_NUMBERS;
        let (others, numbers): (_, Option<Vec<ColumnNumbers>>) = match is_small {
            true => (
                read_others(),
                plain.iter().map(|&leaf| self.numbers(leaf)).collect(),
            ),
            false => {
                let numbers = || plain.par_iter().map(|&leaf| self.numbers(leaf)).collect();
                let together = tumble::on_threads(|| rayon::join(read_others, numbers));
                // If the system refuses to start threads, this thread does all the work.
                together.unwrap_or_else(|_| {
                    let numbers = plain.iter().map(|&leaf| self.numbers(leaf));
                    (read_others(), numbers.collect())
                })
            }
        };
        let (mut others, mut numbers) = (others?.into_iter(), numbers?.into_iter());
        let columns = requested.iter().zip(&leaves).map(|((column, _), leaf)| {
            if leaf.is_none() {
                return others.next();
            }
            Some(Column {
                name: column.name.clone(),
                index: column.index,
                values: ColumnValues::Numbers(numbers.next()?),
                null: None,
            })
        });
        let columns = columns.collect::<Option<Vec<Column>>>()?;
        let rows = columns.first()?.len();
        let is_table = columns.iter().all(|column| column.len() == rows);
        is_table.then(|| Table {
            file: self.name.to_owned(),
            columns,
            rows,
            text: None,
        })
    }

    /// The numbers of a column, if each row has one.
    fn numbers(&self, leaf: usize) -> Option<ColumnNumbers> {
        match self.metadata.parquet_schema().column(leaf).physical_type() {
            Type::FLOAT => self.values::<FloatType>(leaf).map(ColumnNumbers::F32),
            Type::DOUBLE => self.values::<DoubleType>(leaf).map(ColumnNumbers::F64),
            Type::INT64 => self.values::<Int64Type>(leaf).map(ColumnNumbers::Whole),
            _ => None,
        }
    }

    fn values<T>(&self, leaf: usize) -> Option<Vec<T::T>>
    where
        T: parquet::data_type::DataType,
        T::T: Pod,
    {
        let bytes = Arc::new(self.bytes.clone());
        let metadata = self.metadata.metadata();
        let descriptor = self.metadata.parquet_schema().column(leaf);
        let mut values = Vec::new();
        let mut levels = Vec::new();
        for group in metadata.row_groups() {
            let (column, rows) = (group.column(leaf), usize::try_from(group.num_rows()).ok()?);
            values.reserve(rows.min(BATCH));
            let (packing, before) = (column.compression(), values.len());
            let packed = &bytes[chunk(column, bytes.len())?];
            let may_have_nulls = descriptor.max_def_level() > 0;
            if plain::append(packed, packing, may_have_nulls, &mut values).is_some() {
                continue;
            }
            values.truncate(before);
            let pages = SerializedPageReader::new(Arc::clone(&bytes), column, rows, None).ok()?;
            let mut reader = ColumnReaderImpl::<T>::new(Arc::clone(&descriptor), Box::new(pages));
            loop {
                levels.clear();
                // The count of a page is not trusted: memory is reserved for at most one batch.
                let read = reader.read_records(BATCH, Some(&mut levels), None, &mut values);
                let (records, numbers, _) = read.ok()?;
                if records != numbers {
                    return None;
                }
                if records == 0 {
                    break;
                }
            }
        }
        Some(values)
    }
}

/// Whether a column of this type is a list of numbers in their stored form.
fn is_plain(schema: &SchemaDescriptor, leaf: usize, data_type: &DataType) -> bool {
    let column = schema.column(leaf);
    let is_same = matches!(
        (data_type, column.physical_type()),
        (DataType::Float32, Type::FLOAT)
            | (DataType::Float64, Type::DOUBLE)
            | (DataType::Int64, Type::INT64)
    );
    is_same && column.max_rep_level() == 0 && column.max_def_level() <= 1
}

#[cfg(test)]
mod tests {
    use arrow_array::{
        ArrayRef, DurationMillisecondArray, Float32Array, Float64Array, Int64Array, RecordBatch,
        StringArray,
    };
    use parquet::arrow::ArrowWriter;
    use parquet::arrow::arrow_reader::ArrowReaderOptions;
    use parquet::basic::{Compression, Encoding, ZstdLevel};
    use parquet::file::properties::{WriterProperties, WriterPropertiesBuilder, WriterVersion};

    use super::*;
    use crate::format::ReadOptions;
    use crate::table::columns::ColumnNeed;

    /// A file of several groups of rows and several pages each: `time`, `track`, `x` and `count`,
    /// the last two of which may be null, `x` in row `null` is.
    fn file(
        rows: usize,
        properties: WriterPropertiesBuilder,
        null: Option<usize>,
    ) -> ParquetFile<'static> {
        let number = |row: usize| (Some(row) != null).then_some((row as f32).sin());
        let tracks = (0..rows).map(|row| ["hip", "knee"][row % 2]);
        let columns: [(&str, ArrayRef, bool); 4] = [
            (
                "time",
                Arc::new(Float64Array::from_iter_values(
                    (0..rows).map(|row| row as f64),
                )),
                false,
            ),
            (
                "track",
                Arc::new(StringArray::from_iter_values(tracks)),
                false,
            ),
            (
                "x",
                Arc::new((0..rows).map(number).collect::<Float32Array>()),
                true,
            ),
            (
                "count",
                Arc::new(Int64Array::from_iter_values(
                    (0..rows as i64).map(|row| row % 7),
                )),
                true,
            ),
        ];
        let batch = RecordBatch::try_from_iter_with_nullable(columns).unwrap();
        let properties = properties
            .set_max_row_group_row_count(Some(rows * 2 / 5))
            .set_data_page_row_count_limit(150)
            .set_write_batch_size(50);
        let mut bytes = Vec::new();
        let mut writer =
            ArrowWriter::try_new(&mut bytes, batch.schema(), Some(properties.build())).unwrap();
        writer.write(&batch).unwrap();
        writer.close().unwrap();
        let bytes = Bytes::from(bytes);
        let options = ArrowReaderOptions::new();
        ParquetFile {
            name: "t",
            metadata: ArrowReaderMetadata::load(&bytes, options).unwrap(),
            bytes,
        }
    }

    /// The values of each column: numbers, or the codes of words.
    fn numbers(table: &Table) -> Vec<Vec<f64>> {
        let column = |column: &Column| match &column.values {
            ColumnValues::Numbers(numbers) => (0..table.rows).map(|row| numbers.at(row)).collect(),
            ColumnValues::Words { codes, .. } => codes.iter().map(|&code| code.into()).collect(),
            _ => Vec::new(),
        };
        table.columns.iter().map(column).collect()
    }

    fn read(file: &ParquetFile<'_>) -> (Option<Table>, Table) {
        let needs = [
            ("x", 2, ColumnNeed::Number),
            ("track", 1, ColumnNeed::Name),
            ("time", 0, ColumnNeed::Time),
            ("count", 3, ColumnNeed::Whole),
        ];
        let requested = needs.map(|(name, index, need)| RequestedColumn {
            name: name.to_owned(),
            index,
            need,
        });
        let fields = file.metadata.schema().fields();
        let typed: Vec<TypedColumn<'_>> = requested
            .iter()
            .map(|column| (column, fields[column.index].data_type()))
            .collect();
        let gather = Gather::new("t", typed.iter().copied()).unwrap();
        (
            file.read_apart(&typed),
            file.read_together(&typed, gather).unwrap(),
        )
    }

    /// Parquet has whole numbers for durations; only the schema of Arrow beside them has the unit.
    #[test]
    fn durations_have_their_unit() {
        let numbers = |number: f32| Arc::new(Float32Array::from(vec![number; 3])) as ArrayRef;
        let times: ArrayRef = Arc::new(DurationMillisecondArray::from(vec![0, 100, 250]));
        let columns = ["x", "y", "z", "w"].map(|name| (name, numbers(f32::from(name == "w"))));
        let batch =
            RecordBatch::try_from_iter([("time", times)].into_iter().chain(columns)).unwrap();
        let mut bytes = Vec::new();
        let mut writer = ArrowWriter::try_new(&mut bytes, batch.schema(), None).unwrap();
        writer.write(&batch).unwrap();
        writer.close().unwrap();
        let loaded = crate::parquet::read_parquet("t", bytes, &ReadOptions::default()).unwrap();
        assert_eq!(loaded.clips[0].set.track(0).times, [0.0, 0.1, 0.25]);
    }

    #[test]
    fn columns_read_apart_hold_what_they_hold_together() {
        let zstd = Compression::ZSTD(ZstdLevel::default());
        let plain = WriterProperties::builder().set_dictionary_enabled(false);
        let split = plain
            .clone()
            .set_column_encoding("x".into(), Encoding::BYTE_STREAM_SPLIT);
        let delta = plain
            .clone()
            .set_column_encoding("count".into(), Encoding::DELTA_BINARY_PACKED);
        let second = delta.clone().set_writer_version(WriterVersion::PARQUET_2_0);
        for (rows, properties) in [
            (1000, WriterProperties::builder()),
            (1000, plain.clone()),
            (1000, plain.clone().set_compression(zstd)),
            (1000, split.set_compression(Compression::SNAPPY)),
            (1000, delta),
            (1000, second.set_compression(Compression::LZ4_RAW)),
            // Enough for several threads.
            (MIN_PARALLEL_NUMBERS, plain.set_compression(zstd)),
        ] {
            let (apart, together) = read(&file(rows, properties, None));
            let apart = apart.expect("nothing is wrong");
            assert_eq!((apart.rows, together.rows), (rows, rows));
            assert_eq!(numbers(&apart), numbers(&together));
            let indices = |table: &Table| -> Vec<(String, usize)> {
                let columns = table.columns.iter();
                columns
                    .map(|column| (column.name.clone(), column.index))
                    .collect()
            };
            assert_eq!(indices(&apart), indices(&together));
            assert_eq!(numbers(&apart)[0][999], f64::from(999f32.sin()));
        }
    }

    #[test]
    fn a_row_without_a_number_is_left_to_be_found() {
        let (apart, together) = read(&file(1000, WriterProperties::builder(), Some(777)));
        assert!(apart.is_none());
        assert_eq!(together.columns[0].null, Some(777));
    }
}
